"""What the daemon says of itself: nothing is RUNNING that does not happen."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from ema_daemon.health import Health
from ema_daemon.supervision import SupervisionSettings, promised

from ema.bus.protection import Counts
from ema.core.status import BusState, Lapse, LogState, Reason, ServiceState, Status
from ema.monitor import Identified, Job

MESSAGES = ("CycleStart", "CycleEnd", "PhaseCurrents", "Motion", "Supply")
LF2_EVERY = 5.0
NOTHING = Reason(0)


def identified(method="linear", status=Status.VALID, reasons=NOTHING):
    return Identified(1, 3, 7, SimpleNamespace(method=method, status=status, reasons=reasons))


class World:
    """A daemon's surroundings in which everything happens that is promised, but for what is named in `missing`."""

    def __init__(self, scripted, worker=None, **settings):
        self.monitor = SimpleNamespace(counts=Counts(), n_cycles=0, n_estimates=0, heard={}, actuators=frozenset({3}))
        self.port = scripted([], lambda: None)
        self.log = SimpleNamespace(state=LogState.OK, dropped=0, free_bytes=5 << 20, hangs=False)
        self.worker = SimpleNamespace(answers=True)
        remote = {} if worker is None else {worker: lambda: self.worker.answers}
        slower = {"lf2": LF2_EVERY} if worker is None else {worker: LF2_EVERY}
        watch = SupervisionSettings.model_validate(settings)
        self.health = Health(self.monitor, self.port, self.log, promised([3], slower, remote, watch), remote)
        self.methods = ["linear", *slower]
        self.now = 100.0

    def go(self, seconds, *missing):
        """So long everything happens but for these messages and methods; events as (seconds, code)."""
        told, begin = [], self.now
        while self.now < begin + seconds:
            self.now += 0.25
            shown = {(3, m): n + 1 for m in MESSAGES if m not in missing for n in [self.monitor.heard.get((3, m), 0)]}
            self.monitor.heard = self.monitor.heard | shown
            for method in self.methods:
                if method not in missing:
                    self.health.estimated(identified(method), 0.01)
            told += [(self.now - begin, event.code) for event in self.health.look(self.now, 1)]
        return told

    @property
    def state(self):
        return self.health.state

    def beat(self):
        self.health.beat(1)
        beat = self.health.heartbeat(12.7)
        return Lapse(beat["reason"]), beat["concerned"]


@pytest.fixture
def world(scripted):
    made = World(scripted)
    assert made.state is ServiceState.STARTING
    made.go(1.0)
    return made


def test_running_is_everything_that_is_promised(world):
    assert world.go(20.0) == []
    assert world.state is ServiceState.RUNNING
    assert world.beat() == (Lapse.NONE, 255)
    beat = world.health.heartbeat(12.7)
    assert (beat["state"], beat["log_free"], beat["uptime"]) == (ServiceState.RUNNING, 5, 12)
    assert world.health.supervision() == {"reasons": 0, "concerned": 0, "watched": 1 << 3}


def test_nothing_is_running_before_it_has_been_seen(scripted):
    world = World(scripted)
    world.go(0.75, *MESSAGES, "linear", "lf2")
    assert world.state is ServiceState.STARTING
    assert [code for _, code in world.go(2.0, *MESSAGES, "linear", "lf2")] == ["silent"]
    assert world.state is ServiceState.DEGRADED


@pytest.mark.parametrize(
    ("missing", "lapse"),
    [
        ((*MESSAGES, "linear", "lf2"), Lapse.SILENT),
        (("CycleStart", "CycleEnd", "linear", "lf2"), Lapse.NO_CYCLES),
        (("CycleStart", "CycleEnd", "PhaseCurrents", "Motion", "linear", "lf2"), Lapse.NO_CYCLES),  # Supply alone
        (("PhaseCurrents", "linear", "lf2"), Lapse.NO_CURRENTS),
        (("Motion",), Lapse.NO_MOTION),
        (("Supply",), Lapse.NO_SUPPLY),
        (("linear",), Lapse.NO_ESTIMATE),
    ],
)
def test_what_is_late_is_degraded_within_three_seconds_told_once_and_recovers_by_itself(world, missing, lapse):
    ((seconds, code),) = world.go(30.0, *missing)
    assert seconds <= 3.0
    assert code == lapse.name.lower()
    assert world.state is ServiceState.DEGRADED
    assert world.beat() == (lapse, 3)
    said = world.health.supervision()
    assert (said["reasons"], said["concerned"]) == (1 << lapse, 1 << 3)
    assert [code for _, code in world.go(3.0)] == [f"{lapse.name.lower()}_over"]
    assert world.state is ServiceState.RUNNING


def test_one_of_two_markers_is_enough(world):
    assert world.go(20.0, "CycleStart") == []
    assert world.go(20.0, "CycleEnd") == []


def test_a_slower_identifier_has_its_own_period(world):
    ((seconds, code),) = world.go(30.0, "lf2")
    assert LF2_EVERY < seconds <= LF2_EVERY + 3.0
    assert code == "no_estimate"
    assert world.health.supervisor.gravest.subject == "lf2"


def test_estimates_that_cannot_be_used_are_none(world):
    world.methods = ["lf2"]
    for _ in range(20):
        world.health.estimated(identified(status=Status.INVALID), 0.01)
        world.go(0.5)
    assert world.beat()[0] is Lapse.NO_ESTIMATE
    assert world.health.supervisor.gravest.subject == "linear"


@pytest.mark.parametrize("reason", [Reason.CURRENT_A, Reason.CURRENT_SUM, Reason.ROTOR_ANGLE])
def test_a_dead_sensor_is_told_at_once(world, reason):
    world.methods = []
    world.health.estimated(identified(status=Status.INVALID, reasons=reason), 0.01)
    assert world.go(0.25) == [(0.25, "channel")]
    assert world.beat() == (Lapse.CHANNEL, 3)
    world.methods = ["linear", "lf2"]
    assert world.go(0.25) == [(0.25, "channel_over")]


def test_a_late_estimate_is_none_in_time(world):
    world.methods = ["lf2"]
    world.health.estimated(identified(status=Status.DEGRADED, reasons=Reason.LATE), 2.0)
    world.go(0.25)
    assert world.beat() == (Lapse.NO_ESTIMATE, 3)


@pytest.mark.parametrize("how", ["skipped", "failed"])
def test_a_job_that_is_not_done_is_told_by_the_state(world, how):
    world.methods = ["linear"]
    getattr(world.health, how)(Job(1, 3, 7, "lf2", None, NOTHING))
    assert world.go(0.25) == [(0.25, "no_estimate")]
    world.methods = ["linear", "lf2"]
    world.go(0.25)
    assert world.state is ServiceState.RUNNING
    assert world.health.n_skipped + world.health.n_failed == 1


def test_a_dead_worker_is_told_and_not_its_missing_estimates(scripted):
    world = World(scripted, worker="hf")
    world.go(1.0)
    assert world.state is ServiceState.RUNNING
    world.worker.answers = False
    assert world.go(20.0, "hf") == [(0.25, "worker")]
    assert world.beat() == (Lapse.WORKER, 255)
    world.worker.answers = True
    assert world.go(1.0) == [(0.25, "worker_over")]
    assert world.state is ServiceState.RUNNING


@pytest.mark.parametrize(
    ("bus", "lapse"),
    [
        (BusState.DOWN, Lapse.BUS_DOWN),
        (BusState.BUS_OFF, Lapse.BUS_OFF),
        (BusState.ERROR_PASSIVE, Lapse.ERROR_PASSIVE),
    ],
)
def test_the_state_of_the_bus(world, bus, lapse):
    world.port._bus_state = bus
    assert world.go(0.25) == [(0.25, lapse.name.lower())]
    if bus is not BusState.ERROR_PASSIVE:
        assert world.go(30.0, *MESSAGES, "linear", "lf2") == []  # the bus is why
    assert world.beat() == (lapse, 255)
    world.port._bus_state = BusState.ACTIVE
    assert world.go(2.0) == [(0.25, f"{lapse.name.lower()}_over")]


def test_a_flood_is_told(world):
    world.port._flooded = True
    assert world.go(1.0) == [(0.25, "flooded")]
    assert world.state is ServiceState.DEGRADED


def test_a_second_monitor_is_told_with_the_actuator(world):
    world.health.contested = frozenset({3})
    assert world.go(1.0) == [(0.25, "second_monitor")]
    assert world.beat() == (Lapse.SECOND_MONITOR, 3)
    world.health.contested = frozenset()
    assert world.go(1.0) == [(0.25, "second_monitor_over")]


def test_one_that_stands_by_does_not_say_it_runs(world):
    world.health.standing_by = True
    world.go(1.0)
    assert world.state is ServiceState.STANDBY


def test_missing_frames_degrade_until_they_stop_missing(world):
    world.health.beat(1)
    world.monitor.counts = Counts(n_lost=4, n_crc_error=1)
    (event,) = world.health.beat(2)
    assert event.text == "frames since the last heartbeat: 4 lost, 1 with a wrong CRC"
    assert world.state is ServiceState.DEGRADED
    assert Lapse(world.health.heartbeat(1.0)["reason"]) is Lapse.FRAMES
    assert world.health.beat(3) == []
    assert world.state is ServiceState.RUNNING


def test_repeated_frames_are_said_but_do_no_harm(world):
    world.health.beat(1)
    world.monitor.counts = Counts(n_repeated=4)
    assert [event.code for event in world.health.beat(2)] == ["frames"]
    assert world.state is ServiceState.RUNNING


def test_a_full_log_degrades_and_is_said_once(world):
    world.log.state = LogState.FULL
    assert world.go(5.0) == [(0.25, "log")]
    assert world.state is ServiceState.DEGRADED
    assert world.beat() == (Lapse.LOG, 255)
    assert world.health.heartbeat(0.0)["log_state"] == LogState.FULL
    world.log.state = LogState.OK
    assert world.go(1.0) == [(0.25, "log_over")]


def test_a_log_whose_device_hangs_is_not_written(world):
    world.log.hangs = True
    assert world.go(1.0) == [(0.25, "log")]
    assert world.state is ServiceState.DEGRADED


def test_what_happens_to_the_link_is_an_event(world):
    world.port._events.append("vcan0: link down")
    assert [e.text for e in world.health.look(world.now, 1)] == ["vcan0: link down"]


def test_deadlines_are_settings(scripted):
    world = World(scripted, cycle=60.0)
    world.go(1.0)
    assert world.go(59.0, "CycleStart", "CycleEnd", "PhaseCurrents", "Motion", "linear") == []


def test_the_longest_wait_for_an_estimate_is_counted(world):
    world.health.estimated(identified(), 0.125)
    world.health.estimated(identified(), 0.0625)
    world.health.beat(1)
    assert world.health.counters["latency_us"] == 125_000
    assert np.isclose(replace(world.health).latency, 0.0)
