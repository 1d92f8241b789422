"""How old an estimate may be when it is sent, and in which order."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from ema_daemon.arrival import Arrival

from ema.core import frames as fr
from ema.core.status import Reason, Status
from ema.monitor import Identified, Timeliness, Untimely


@dataclass(frozen=True)
class Said:
    method: str = "linear"
    status: Status = Status.VALID
    reasons: Reason = Reason.SATURATED


def judged(timeliness, cycle, arrived, now, said=None, actuator=0):
    verdict = timeliness.judge(Identified(10**9 * cycle, actuator, cycle, said or Said()), arrived, now)
    return verdict, verdict.out.estimate


@pytest.fixture
def timeliness():
    return Timeliness({"linear": 1.0, "hf": 10.0}.__getitem__)


def test_one_in_time_is_left_as_it_is(timeliness):
    verdict, estimate = judged(timeliness, 1, 5.0, 5.9)
    assert (verdict.age, verdict.to_bus, verdict.event) == (pytest.approx(0.9), True, None)
    assert estimate == Said()


@pytest.mark.parametrize("status", list(Status))
def test_one_older_than_its_budget_is_degraded_and_told(timeliness, status):
    verdict, estimate = judged(timeliness, 1, 5.0, 6.5, Said(status=status))
    assert verdict.to_bus
    assert verdict.event.code == Untimely.LATE
    assert estimate.status == max(status, Status.DEGRADED)
    assert estimate.reasons == Reason.SATURATED | Reason.LATE


def test_the_budget_is_that_of_the_method(timeliness):
    assert judged(timeliness, 1, 5.0, 14.9, Said("hf"))[0].event is None


def test_one_of_an_older_cycle_than_was_sent_is_not_sent(timeliness):
    judged(timeliness, 8, 5.0, 5.1)
    verdict, estimate = judged(timeliness, 7, 4.0, 5.2)
    assert not verdict.to_bus
    assert verdict.event.code == Untimely.OUTDATED
    assert estimate.reasons & Reason.LATE
    assert judged(timeliness, 9, 6.0, 6.1)[0].to_bus
    assert not judged(timeliness, 8, 5.5, 6.2)[0].to_bus  # newer than the first, older than the newest


def test_other_actuators_and_methods_have_their_own_order(timeliness):
    judged(timeliness, 8, 5.0, 5.1)
    assert judged(timeliness, 7, 4.0, 5.2, Said("hf"))[0].to_bus
    assert judged(timeliness, 7, 4.8, 5.2, actuator=1)[0].to_bus


def frame(t_ns):
    one = fr.empty(1)
    one["t_ns"] = t_ns
    return one


def test_the_wait_in_the_receive_buffer_counts():
    arrival = Arrival()
    arrival.note(frame(50 * 10**9), 53 * 10**9, 1000.0)
    assert arrival.of(0, 50 * 10**9) == pytest.approx(997.0)
    assert arrival.of(1, 49 * 10**9) == pytest.approx(996.0)


def test_cycles_of_an_actuator_arrive_in_their_order_whatever_the_stamps_say():
    arrival = Arrival()
    arrival.note(frame(50 * 10**9), 50 * 10**9, 1000.0)
    first = arrival.of(0, 50 * 10**9)
    arrival.note(frame(40 * 10**9), 40 * 10**9 + 10**8, 1000.05)
    assert arrival.of(0, 40 * 10**9) >= first


def test_the_age_does_not_jump_with_the_wall_clock():
    arrival = Arrival()
    arrival.note(frame(50 * 10**9), 50 * 10**9, 1000.0)
    assert arrival.of(0, 50 * 10**9) == pytest.approx(1000.0)
    arrival.note(frame(9_000 * 10**9), 9_000 * 10**9, 1001.0)  # set forward by hours
    assert arrival.of(0, 50 * 10**9) == pytest.approx(1000.0)
    assert arrival.of(0, 9_000 * 10**9) == pytest.approx(1001.0)


def test_stamps_of_another_clock_count_from_the_reading():
    arrival = Arrival()
    arrival.note(frame(77), 1_700_000_000 * 10**9, 1000.0)
    assert arrival.of(0, 77) == pytest.approx(1000.0)
