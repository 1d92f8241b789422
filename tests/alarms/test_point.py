"""The states of an alarm, transition by transition (ISA-18.2)."""

from __future__ import annotations

import pytest

from ema.alarms import Point
from ema.alarms.settings import Latching
from ema.core.status import AlarmLevel, AlarmState

NONE, WATCH, ALARM = AlarmLevel
INACTIVE, ACTIVE, ACKNOWLEDGED, LATCHED, SHELVED = AlarmState
LATCHING, FREE = Latching(watch=True, alarm=True), Latching(watch=False, alarm=False)


def after(*steps, latching=LATCHING):
    """State and level after levels of the condition and what an operator does, in this order."""
    point = Point(latching)
    for cycle, step in enumerate(steps):
        if isinstance(step, AlarmLevel):
            point.judge(step, cycle, 1000 + cycle)
        else:
            getattr(point, step)()
    return point.state, point.level


@pytest.mark.parametrize(
    ("steps", "latching", "expected"),
    [
        ((), LATCHING, (INACTIVE, NONE)),
        ((NONE,), LATCHING, (INACTIVE, NONE)),
        ((WATCH,), LATCHING, (ACTIVE, WATCH)),
        ((WATCH, "acknowledge"), LATCHING, (ACKNOWLEDGED, WATCH)),
        ((WATCH, NONE), LATCHING, (LATCHED, WATCH)),
        ((WATCH, NONE), FREE, (LATCHED, WATCH)),  # nobody has seen it yet
        ((WATCH, NONE, "acknowledge"), FREE, (INACTIVE, NONE)),
        ((WATCH, NONE, "acknowledge"), LATCHING, (LATCHED, WATCH)),
        ((WATCH, "acknowledge", NONE), FREE, (INACTIVE, NONE)),
        ((WATCH, "acknowledge", NONE), LATCHING, (LATCHED, WATCH)),
        ((WATCH, "acknowledge", NONE, "clear"), LATCHING, (INACTIVE, NONE)),
        ((WATCH, "clear"), LATCHING, (ACTIVE, WATCH)),  # what holds is not cleared
        ((WATCH, "acknowledge", ALARM), LATCHING, (ACTIVE, ALARM)),  # worse: to be seen again
        ((ALARM, "acknowledge", WATCH), LATCHING, (ACKNOWLEDGED, ALARM)),
        ((ALARM, "acknowledge", WATCH), FREE, (ACKNOWLEDGED, WATCH)),
        ((ALARM, "acknowledge", NONE, WATCH), LATCHING, (ACTIVE, ALARM)),  # it has come again
        (("acknowledge",), LATCHING, (INACTIVE, NONE)),
        (("clear",), LATCHING, (INACTIVE, NONE)),
    ],
)
def test_transitions(steps, latching, expected):
    assert after(*steps, latching=latching) == expected


def test_a_shelved_alarm_goes_on_being_judged_and_comes_back_to_be_seen():
    point = Point(LATCHING)
    point.judge(WATCH, 1, 1000)
    point.acknowledge()
    point.shelve(5000)
    point.judge(ALARM, 2, 2000)
    assert (point.state, point.level) == (SHELVED, ALARM)
    point.unshelve()
    assert (point.state, point.level, point.since_cycle) == (ACTIVE, ALARM, 2)


def test_a_snapshot_holds_everything():
    point = Point(LATCHING)
    point.judge(ALARM, 7, 1000)
    point.acknowledge()
    again = Point(LATCHING)
    again.restore(point.snapshot())
    assert again == point
    again.judge(NONE, 8, 2000)
    assert (again.state, again.since_cycle) == (LATCHED, 7)
