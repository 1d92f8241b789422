"""Two monitors on one bus: one speaks, and each says who is there."""

from __future__ import annotations

import numpy as np
import pytest
from ema_daemon.turn import Turn

from ema.bus import codec as codecs
from ema.bus.protection import Sender
from ema.core.errors import OccupiedError
from ema.monitor.presence import Presence

CODEC = codecs.default()
HEARTBEAT = {name: 0 for name in CODEC.messages["Heartbeat"].fields}


class Other:
    """What another monitor sends."""

    def __init__(self):
        self.sender = Sender()

    def beat(self, watched, uptime=532):
        bits = np.uint64(sum(1 << n for n in watched))
        supervision = {"reasons": 0, "concerned": np.uint64(0), "watched": bits}
        return self.sent("Heartbeat", 0, HEARTBEAT | {"uptime": uptime}), self.sent("Supervision", 0, supervision)

    def estimate(self, actuator):
        fields = CODEC.messages["EstimateLf2"].fields
        zeros = {name: np.zeros((1, field.n_values) if field.n_values else 1) for name, field in fields.items()}
        return self.sent("EstimateLf2", actuator, zeros)

    def sent(self, name, actuator, values):
        return self.sender.protect(CODEC.encode(name, actuator, values))


@pytest.fixture
def other():
    return Other()


@pytest.fixture
def make():
    def turn(standby=False, watched=(0, 3)):
        return Turn(Presence(CODEC, frozenset(watched)), "vcan0", 1.5, standby)

    return turn


def hear(turn, frames, now):
    assert not turn.presence.without(np.concatenate(frames), now).size


def test_alone_it_speaks_after_it_has_listened(make):
    turn = make()
    assert turn.look(100.0, 0.0) is None
    assert (turn.listening, turn.speaking) == (True, False)
    assert turn.look(101.5, 1.5) is None
    assert turn.speaking


def test_beside_another_one_of_the_same_actuator_it_refuses_and_says_who_is_there(make, other):
    turn = make()
    turn.look(100.0, 0.0)
    hear(turn, other.beat([3, 9]), 100.4)
    with pytest.raises(OccupiedError, match=r"vcan0: another monitor, running for 532 s, watches actuator 3 already"):
        turn.look(101.5, 1.5)


def test_estimates_alone_show_it_as_well(make, other):
    turn = make()
    hear(turn, [other.estimate(3)], 100.4)
    with pytest.raises(OccupiedError, match="watches actuator 3"):
        turn.look(101.5, 1.5)


def test_one_of_other_actuators_is_no_reason(make, other):
    turn = make()
    hear(turn, [*other.beat([1, 2, 63]), other.estimate(63)], 100.4)
    assert turn.look(101.5, 1.5) is None
    assert turn.speaking


def test_a_forged_sign_of_life_is_none(make, other):
    turn = make()
    frames = np.concatenate(other.beat([3]))
    frames["data"][:, 9] ^= 1
    hear(turn, [frames], 100.4)
    turn.look(101.5, 1.5)
    assert turn.speaking


def test_in_standby_it_takes_over_when_the_other_falls_silent(make, other):
    turn = make(standby=True)
    hear(turn, other.beat([3]), 100.4)
    code, text = turn.look(101.5, 1.5)
    assert code == "standby"
    assert "running for 532 s" in text
    assert not turn.speaking
    hear(turn, other.beat([3]), 102.0)
    assert turn.look(104.9, 5.0) is None
    code, _ = turn.look(105.1, 5.2)
    assert code == "takeover"
    assert turn.speaking


def test_the_younger_one_in_standby_gives_way(make, other):
    turn = make(standby=True)
    turn.look(101.5, 1.5)
    hear(turn, other.beat([3], uptime=2), 110.0)
    assert turn.look(110.0, 10.0) is None
    hear(turn, other.beat([3], uptime=11), 111.0)
    assert turn.look(111.0, 10.5)[0] == "standby"


def test_without_standby_a_second_one_is_told_and_none_gives_way(make, other):
    turn = make()
    turn.look(101.5, 1.5)
    hear(turn, other.beat([3]), 110.0)
    assert turn.look(110.0, 10.0) is None
    assert turn.speaking
    assert turn.presence.other(110.0).actuators == {3}
    assert turn.presence.other(113.1) is None


def test_an_actuators_frames_are_left(make):
    frames = Sender().protect(CODEC.encode("Supply", 3, {"u_dc": [48.0], "temp_w": 20.0}))
    assert make().presence.without(frames, 1.0).size == 1
