from __future__ import annotations

from types import SimpleNamespace

import pytest
from ema_daemon.health import Health

from ema.bus.protection import Counts
from ema.core.status import LogState, ServiceState


@pytest.fixture
def health(scripted):
    monitor = SimpleNamespace(counts=Counts(), n_cycles=0, n_estimates=0, silent=[])
    monitor.time_outs = lambda now_ns: monitor.silent
    log = SimpleNamespace(state=LogState.OK, dropped=0, free_bytes=5 << 20)
    return Health(monitor, scripted([], lambda: None), log)


def codes(events):
    return [event.code for event in events]


def test_nothing_wrong(health):
    assert health.look(1) == []
    assert health.state is ServiceState.RUNNING
    beat = health.heartbeat(12.7)
    assert (beat["state"], beat["log_free"], beat["uptime"]) == (ServiceState.RUNNING, 5, 12)


def test_missing_frames_degrade_until_they_stop_missing(health):
    health.look(1)
    health.monitor.counts = Counts(n_lost=4, n_crc_error=1)
    (event,) = health.look(2)
    assert event.text == "frames since the last heartbeat: 4 lost, 1 with a wrong CRC"
    assert health.state is ServiceState.DEGRADED
    assert health.look(3) == []
    assert health.state is ServiceState.RUNNING


def test_repeated_frames_are_said_but_do_no_harm(health):
    health.look(1)
    health.monitor.counts = Counts(n_repeated=4)
    assert codes(health.look(2)) == ["frames"]
    assert health.state is ServiceState.RUNNING


def test_a_silent_actuator_is_said_once_and_so_is_its_return(health):
    health.monitor.silent = [("Supply", 3)]
    assert codes(health.look(1)) == ["time_out"]
    assert codes(health.look(2)) == []
    assert health.state is ServiceState.DEGRADED
    health.monitor.silent = []
    assert codes(health.look(3)) == ["in_time"]
    assert health.state is ServiceState.RUNNING


def test_a_full_log_degrades_and_is_said_once(health):
    health.log.state = LogState.FULL
    assert [e.text for e in health.look(1)] == ["log: full"]
    assert health.look(2) == []
    assert health.state is ServiceState.DEGRADED
    assert health.heartbeat(0.0)["log_state"] == LogState.FULL
    health.log.state = LogState.OK
    assert [e.text for e in health.look(3)] == ["log: ok"]


def test_what_happens_to_the_link_is_an_event(health):
    health.port._events.append("vcan0: link down")
    assert [e.text for e in health.look(1)] == ["vcan0: link down"]
