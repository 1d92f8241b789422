import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ema.bus import identifiers


@given(st.integers(0, 0x1FFFFFFF), st.integers(0, 63))
def test_the_actuator_is_one_field_of_the_identifier(frame_id, number):
    other = identifiers.with_actuator(frame_id, number)
    assert identifiers.actuator(other) == identifiers.parse(other).actuator == number
    assert identifiers.message_id(other) == identifiers.message_id(frame_id)


def test_arrays_are_taken_as_they_are():
    ids = np.array([0x0B230300, 0x0B23030C, 0x0B2303FC], np.uint32)
    assert identifiers.actuator(ids).tolist() == [0, 3, 63]
    assert set(identifiers.message_id(ids).tolist()) == {0x0B230300}


@pytest.mark.parametrize("number", [-1, 64])
def test_there_are_64_actuators(number):
    with pytest.raises(ValueError, match="0…63"):
        identifiers.with_actuator(0x0B230300, number)
