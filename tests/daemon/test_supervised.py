"""A real daemon on a bus: what it says when something falls silent, and beside another daemon."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from ema.bus import codec
from ema.bus.interface import BusSettings, open_bus
from ema.core.status import Lapse, ServiceState
from ema.log import LogReader

EMA = Path(sys.executable).with_name("ema")
BUS = {"interface": "udp_multicast", "channel": f"239.78.{os.getpid() % 200}.{os.getpid() // 200 % 200}"}
PATIENCE = 60.0  # for what a busy machine takes long for [s]
PACED = 0.8  # a cycle's frames are sent in this time [s]


@pytest.fixture
def start(write_config, tmp_path):
    """Starts a daemon with its own log; ended with the test."""
    running = []

    def go(name, **other):
        (tmp_path / name).mkdir()
        content = yaml.safe_load(write_config(bus=BUS, log={"directory": name}, **other).read_text())
        config = tmp_path / f"{name}.yaml"
        config.write_text(yaml.safe_dump(content))
        process = subprocess.Popen([EMA, "daemon", "--config", config], stderr=subprocess.PIPE, text=True)
        running.append(process)
        return process

    yield go
    for process in running:
        process.kill()
        process.communicate()


class Hearer:
    """Hears the daemon and plays the actuator."""

    def __init__(self, port):
        self.port, self.codec = port, codec.default()
        self.message = self.codec.messages["Heartbeat"]

    def beats(self, seconds, frames=None):
        """Heartbeats heard within this time, while these frames are sent evenly in it: (seconds, state, reason)."""
        begin, heard, sent = time.monotonic(), [], 0
        while (now := time.monotonic() - begin) < seconds:
            if frames is not None:
                upto = min(frames.size, int(frames.size * now / min(seconds, PACED)) + 1)
                self.port.write(frames[sent:upto])
                sent = upto
            for message, own in self.codec.split(self.port.read(0.02)):
                if message is self.message:
                    values = message.decode(own)
                    codes = zip(values["state"], values["reason"], strict=True)
                    heard += [(now, ServiceState(s), Lapse(r)) for s, r in codes]
        return heard

    def wait_for(self, wanted):
        """Seconds until a heartbeat says so: a state, or a reason."""
        begin = time.monotonic()
        while time.monotonic() - begin < PATIENCE:
            for seconds, state, reason in self.beats(0.1):
                if wanted in (state, reason):
                    return time.monotonic() - begin - 0.1 + seconds
        raise AssertionError(f"no heartbeat says {wanted.name}")


@pytest.fixture
def tester():
    with open_bus(BusSettings(**BUS), codec.default().filters("Monitor")) as port:
        yield Hearer(port)


def per_cycle(frames):
    number = (frames["t_ns"] - frames["t_ns"][0]) // 10**9
    return [frames[number == n] for n in range(int(number.max()) + 1)]


def test_silence_is_never_running(start, tester, frames, tmp_path):
    process = start("only", monitor={"slower": {"lf2": {"every": 1.0}}})
    tester.wait_for(Lapse.SILENT)  # nobody sends anything
    for cycle in per_cycle(frames)[:4]:
        heard = tester.beats(1.0, cycle)
    assert heard[-1][1:] == (ServiceState.RUNNING, Lapse.NONE)
    currents = tester.codec.messages["PhaseCurrents"].frame_id
    for cycle in per_cycle(frames)[4:]:
        tester.beats(1.0, cycle[cycle["id"] != currents])
    tester.wait_for(Lapse.SILENT)
    process.send_signal(signal.SIGTERM)
    assert process.wait(PATIENCE) == 0
    with LogReader(tmp_path / "only") as log:
        events = [m.content["code"] for m in log.messages(lambda topic: topic == "/event")]
        reasons = [m.content["lapses"] for m in log.messages(lambda topic: topic == "/status")]
    told = [code for code in events if code in {"silent", "silent_over"}]
    assert told == ["silent", "silent_over", "silent"]
    assert {"reason": "silent", "actuator": 0, "subject": ""} in reasons[-1]


def test_a_second_daemon_refuses_and_one_in_standby_takes_over(start, tester, tmp_path):
    first = start("first")
    tester.wait_for(Lapse.SILENT)
    second = start("second")
    _, said = second.communicate(timeout=PATIENCE)
    assert second.returncode == 2
    assert "another monitor" in said.splitlines()[-1]
    assert "watches actuator 0 already" in said.splitlines()[-1]
    assert "Traceback" not in said
    third = start("third", standby=True)
    assert any("standing by: another monitor" in third.stderr.readline() for _ in range(10))
    first.kill()
    first.wait()
    tester.beats(0.5)
    assert tester.wait_for(ServiceState.DEGRADED) > 0  # nobody but the third is left to say it
    third.send_signal(signal.SIGTERM)
    assert third.wait(PATIENCE) == 0
    with LogReader(tmp_path / "third") as log:
        codes = [m.content["code"] for m in log.messages(lambda topic: topic == "/event")]
        states = np.array([m.content["state"] for m in log.messages(lambda topic: topic == "/status")])
    assert [code for code in codes if code in {"standby", "takeover"}] == ["standby", "takeover"]
    assert (states == "standby").any()
