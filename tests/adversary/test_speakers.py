"""Somebody else speaks in an actuator's name, without a key: nothing made of the mixture is valid."""

from __future__ import annotations

import threading

import pytest
from attacked import ActuatorOnBus, reasons, statuses

from ema.bus.interface import BusSettings, open_bus
from ema.core.status import Reason, ServiceState, Status


@pytest.fixture
def another(coarse_bundle):
    """A second sender of the same actuator number, beginning whenever it does."""
    began = []

    def speak(daemon):
        port = open_bus(BusSettings(**daemon.bus), [])
        began.append((ActuatorOnBus(port, coarse_bundle.plant), port))
        began[-1][0].start()
        return began[-1][0]

    yield speak
    for speaker, port in began:
        speaker.stop()
        port.close()


def test_two_speak_in_the_name_of_one_actuator(attack, another, tell, times):
    n, delays = times(1, 5), []
    daemon = attack()
    for trial in range(n):
        daemon.until_state(ServiceState.RUNNING)
        threading.Event().wait(0.37 * (trial + 1) % 1.0)  # of the genuine one's cycle
        second = another(daemon)
        _, late = daemon.until(lambda one: one.name == "EstimateLinear" and bool(reasons(one) & Reason.TWO_SPEAKERS))
        during = daemon.estimates(2)
        second.stop()
        assert set(statuses(during)) == {Status.INVALID}
        assert all(reasons(one) & Reason.TWO_SPEAKERS for one in during)
        _, again = daemon.until(lambda one: one.name == "EstimateLinear" and one.values["status"] == Status.VALID)
        delays.append((late, again))
    assert daemon.stop() == 0
    codes = [event["code"] for event in daemon.events()]
    assert (codes.count("two_speakers"), codes.count("one_speaker")) == (n, n)
    late, again = map(max, zip(*delays, strict=True))
    tell("a second sender of the same actuator number, without a key", n,
         f"invalid, `two_speakers`, after {late:.1f} s, an event at begin and end; valid {again:.1f} s after it stops",
         "the actuator's estimates meanwhile")  # fmt: skip
