"""A daemon process and the actuator that feeds it, for trials of endurance: on a multicast group of their own."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema import bundle as bundles
from ema.bus import codec as codecs
from ema.bus.interface import BusSettings, open_bus
from ema.core.closing import Closing

EMA = Path(sys.executable).with_name("ema")
N_DIFFERENT = 8  # simulated cycles, sent again and again under new numbers
K = [0.02, 0.0, 0.04, 0.0, 0.0, 0.01]
PERIOD = 1.0  # of the scenario; the rig sends as fast as it is asked to [s]
_CHUNK = 64  # frames given to the bus at once


class Figures(NamedTuple):
    """What the system says of a process."""

    rss: int  # resident memory [B]
    n_files: int
    n_threads: int
    cpu: float  # processor time so far [s]


def figures(pid: int) -> Figures:
    """Figures of a running process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    rss = int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    cpu = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return Figures(rss, len(os.listdir(f"/proc/{pid}/fd")), int(fields[17]), cpu)


class Rig(Closing):
    """Actuator 0 on the bus and a daemon, which can be started, killed and started again in the same log directory.

    Parameters
    ----------
    folder : Path
        For configuration and log.
    bundle : Path
    log : mapping
        Settings of the daemon's section `log`.
    """

    def __init__(self, folder: Path, bundle: Path, **log: Any):
        pid = os.getpid()
        bus = {"interface": "udp_multicast", "channel": f"239.74.{pid % 250}.{pid // 250 % 250}"}
        self.log = folder / "log"
        self.log.mkdir(parents=True, exist_ok=True)
        self._config = folder / "daemon.yaml"
        settings = {"bus": bus, "actuators": {0: {"bundle": str(bundle.resolve())}}, "log": {"directory": "log", **log}}
        self._config.write_text(yaml.safe_dump(settings))
        self._said = folder / "stderr.txt"
        self._codec = codecs.default()
        self._estimate = self._codec.messages["EstimateLinear"]
        self._port = open_bus(BusSettings(**bus), self._codec.filters("Monitor"))
        fleet = Fleet(Scenario(period=PERIOD), bundles.load(bundle).plant)
        self._cycles = [fleet.next_cycle(np.array([K])) for _ in range(N_DIFFERENT)]
        self._traffic = Traffic(self._codec, [0])
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Process number of the daemon."""
        assert self._process
        return self._process.pid

    def start(self) -> None:
        """Start a daemon and wait for its first heartbeat."""
        with self._said.open("ab") as said:
            self._process = subprocess.Popen([EMA, "daemon", "--config", self._config], stderr=said)
        end = time.monotonic() + 60
        while not any(name == "Heartbeat" for name, _, _ in self._heard(0.2)):
            if self._process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"the daemon does not start: {self._said.read_text()[-2000:]}")

    def kill(self) -> None:
        """SIGKILL."""
        assert self._process
        self._process.kill()
        self._process.wait()

    def stop(self) -> int:
        """SIGTERM; the daemon's exit status."""
        assert self._process
        self._process.terminate()
        return self._process.wait(timeout=60)

    def send(self, number: int, duration: float = 0.0) -> int:
        """Send the cycle `number` within about `duration` [s]; the time after its last frame. [ns]"""
        cycle = self._cycles[number % N_DIFFERENT]._replace(number=number, t_start=number * PERIOD)
        frames, _ = self._traffic.frames(cycle, PERIOD)
        for start in range(0, len(frames), _CHUNK):
            self._port.write(frames[start : start + _CHUNK])
            if duration:
                time.sleep(duration * _CHUNK / len(frames))
        return time.time_ns()

    def answers(self, timeout: float) -> list[tuple[int, int]]:
        """(cycle, time of arrival in ns) of linear estimates heard within `timeout` [s], at least one if possible."""
        return [
            (cycle, t_ns) for name, cycle, t_ns in self._heard(timeout, until="EstimateLinear") if name != "Heartbeat"
        ]

    def _heard(self, timeout: float, until: str = "") -> list[tuple[str, int, int]]:
        heard: list[tuple[str, int, int]] = []
        end = time.monotonic() + timeout
        while True:
            for message, frames in self._codec.split(self._port.read(max(0.0, end - time.monotonic()))):
                if message.name == "EstimateLinear":
                    cycles = message.decode(frames)["cycle"].tolist()
                    heard += zip([message.name] * len(frames), cycles, frames["t_ns"].tolist(), strict=True)
                elif message.name == "Heartbeat":
                    heard += [(message.name, -1, t_ns) for t_ns in frames["t_ns"].tolist()]
            if any(not until or name == until for name, _, _ in heard) or time.monotonic() >= end:
                return heard

    def close(self) -> None:
        """Kill the daemon if it runs, and leave the bus."""
        if self._process and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._port.close()
