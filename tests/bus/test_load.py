import pytest

from ema.bus.load import frame_time, load, sealed


def test_a_full_frame_by_hand():
    """64 bytes: 36 bits before and 13 after the data phase; in it 5 of control, 512 of data, 32 of check."""
    assert frame_time(64, 1e6, 5e6) == pytest.approx(49e-6 + 549 / 5e6)
    assert frame_time(8, 1e6, 5e6) == pytest.approx(49e-6 + (5 + 64 + 27) / 5e6)


def test_stuff_bits_only_add(codec):
    for length in (0, 8, 16, 20, 64):
        assert frame_time(length, 1e6, 5e6) < frame_time(length, 1e6, 5e6, worst=True)


def test_how_many_actuators_a_bus_carries(codec):
    own = [m for m in codec.messages.values() if m.sender == "Actuator"]
    share = load(own, 1e6, 5e6)
    assert share == pytest.approx(1100 * 158.8e-6 + 10 * 68.2e-6)
    assert load(own, 1e6, 5e6, worst=True) < 1.3 * share


def test_authentication_takes_a_fifth_more(codec):
    """By hand: a seal for five frames of 1 and 10 ms, one for each of 100 ms."""
    own = [m for m in codec.messages.values() if m.sender == "Actuator"]
    seals = (1000 / 5 + 100 / 5 + 10) * frame_time(64, 1e6, 5e6)
    assert load(sealed(own, codec), 1e6, 5e6) - load(own, 1e6, 5e6) == pytest.approx(seals)
    assert 0.15 < seals / load(own, 1e6, 5e6) < 0.25
