import numpy as np
import pytest
from hypothesis import strategies as st

from ema.bus.codec import Codec, default
from ema.core import frames as fr


def _frames(rows):
    frames = fr.empty(len(rows))
    for frame, (frame_id, flags, length, data, t_ns) in zip(frames, rows, strict=True):
        frame["id"], frame["flags"], frame["length"], frame["t_ns"] = frame_id, flags, length, t_ns
        frame["data"][: len(data)] = list(data)
    return frames


@pytest.fixture(scope="session")
def any_frames():
    """Strategy: arbitrary frames, most of them with an identifier and a format of the DBC."""
    ids = st.sampled_from([m.frame_id for m in default().messages.values()])
    row = st.tuples(
        st.one_of(ids, ids, st.integers(0, 0x1FFFFFFF)),
        st.one_of(st.just(9), st.integers(0, 255)),
        st.one_of(st.sampled_from([8, 20, 24, 48, 64]), st.integers(0, 255)),
        st.binary(max_size=64),
        st.one_of(st.integers(0, 10**9), st.integers(0, 2**64 - 1)),
    )
    return st.lists(row, max_size=20).map(_frames)


@pytest.fixture(scope="session")
def codec() -> Codec:
    return default()


@pytest.fixture
def currents(codec):
    """Makes `n` frames of phase currents of actuator 3, headers not filled."""

    def make(n: int, seed: int = 1):
        rng = np.random.default_rng(seed)
        values = {f"i_{phase}": rng.uniform(-30, 29.9, (n, 10)) for phase in "abc"}
        return codec.encode("PhaseCurrents", 3, values, t_ns=np.arange(n) * 1_000_000)

    return make
