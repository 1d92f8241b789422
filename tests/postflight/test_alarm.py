"""`ema alarm` against a monitor's alarms on a bus: what is asked is done, and what cannot be done is said."""

from __future__ import annotations

import json
import os
import threading
import time

import numpy as np
import pytest
from click.testing import CliRunner
from desks import desk
from ema_postflight import alarm as module

from ema.alarms import Judged
from ema.bus.interface import open_bus, parse
from ema.cli import cli
from ema.core.status import LogState, Reason, ServiceState, Status
from ema.log import LogWriter, contents

SECOND = 1_000_000_000


class Monitor(threading.Thread):
    """Alarms on a bus, with heartbeats five times as fast; k1 of actuator 0 stands, k2's condition has gone."""

    def __init__(self, bus, folder):
        super().__init__(daemon=True)
        self.bus, self.folder, self.stop = bus, folder, threading.Event()
        self.ready = threading.Event()

    def run(self):
        with (
            open_bus(parse(self.bus)) as port,
            LogWriter(self.folder) as log,
            desk([0, 1], port, log, self.folder) as alarms,
        ):
            now = time.time_ns()
            for cycle in range(10):
                k = np.array([0.3, 0.3 if cycle < 5 else 0.0, 0, 0, 0, 0])
                seen = Judged(now + cycle, 0, cycle, k, np.full(6, 0.002), Status.VALID, Reason(0))
                alarms._tell(alarms.alarms.estimate(seen))
            while not self.stop.is_set():
                for command in alarms.hear(port.read(0.05)):
                    alarms.take(command)
                lapses = [("silent", 1, "")]
                status = contents.status(time.time_ns(), ServiceState.DEGRADED, 1.0, LogState.OK, 1e9, {})
                alarms.beat(status | {"lapses": [{"reason": r, "actuator": a, "subject": s} for r, a, s in lapses]})
                self.ready.set()


@pytest.fixture
def bus(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_LISTENS", 0.8)
    name = f"udp_multicast:239.75.{os.getpid() % 200}.{os.getpid() // 200 % 200}"
    monitor = Monitor(name, tmp_path)
    monitor.start()
    assert monitor.ready.wait(30)
    yield name
    monitor.stop.set()
    monitor.join(30)


def run(*arguments):
    return CliRunner().invoke(cli, ["alarm", *arguments])


def listed(bus):
    found = json.loads(run("list", "--bus", bus, "--json").output)
    return {(a["actuator"], a["cause"]): (a["level"], a["state"]) for a in found}


def test_what_an_operator_does(bus):
    assert listed(bus) == {
        (0, "k1"): ("alarm", "active"),
        (0, "k2"): ("alarm", "latched_cleared"),
        (1, "silent"): ("alarm", "active"),
    }
    lines = run("list", "--bus", bus).output.splitlines()
    assert lines[0].split()[:3] == ["0.k1", "alarm", "active"]
    assert "dry friction; k = 0.300, at least 0.297" in lines[0]

    done = run("ack", "0.k1", "1.silent", "--bus", bus)
    assert done.exit_code == 0, done.output
    done = run("clear", "0.k2", "--bus", bus)
    assert done.exit_code == 0, done.output
    assert listed(bus) == {(0, "k1"): ("alarm", "acknowledged"), (1, "silent"): ("alarm", "acknowledged")}
    assert run("shelve", "0.k1", "--for", "2", "--bus", bus).exit_code == 0
    assert listed(bus)[0, "k1"] == ("alarm", "shelved")
    assert run("unshelve", "0.k1", "--bus", bus).exit_code == 0
    assert listed(bus)[0, "k1"] == ("alarm", "active")


def test_what_cannot_be_done_is_said(bus, monkeypatch):
    monkeypatch.setattr(module, "_ANSWERS_WITHIN", 1.0)
    refused = run("clear", "0.k1", "--bus", bus)
    assert "0.k1 is not cleared: its condition holds" in str(refused.exception)
    silent = run("list", "--bus", "udp_multicast:239.75.250.250")
    assert "no monitor tells of alarms" in str(silent.exception)


@pytest.mark.parametrize("name", ["0.k7", "k1", "64.k1", "monitor.k1", "0.log", "-1.k1"])
def test_a_name_that_is_none_is_refused(name):
    refused = run("ack", "--bus", "virtual:x", "--", name)
    assert refused.exit_code == 2
    assert "must be" in refused.output or "the causes are" in refused.output
