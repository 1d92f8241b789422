"""A daemon process to attack, the actuator it watches, and an ear for what it says."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from e2e.p05 import e2e_p05_protect
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.interface import BusSettings, open_bus
from ema.bus.port import Port
from ema.bus.protection import GOOD, Receiver
from ema.core import frames as fr
from ema.core.status import Lapse, Reason, ServiceState, Status
from ema.log import LogReader

EMA = Path(sys.executable).with_name("ema")
PATIENCE = 60.0  # on a busy machine; how long something took is told, not judged [s]
PERIOD = 1.0  # of test cycles [s]
K = [0.02, 0.0, 0.04, 0.0, 0.0, 0.01]
SEED = 23
N_DIFFERENT = 3  # cycles are simulated once and sent again and again under new numbers
_CHUNK = 0.01  # frames that are due within so long leave together [s]
_GROUPS = itertools.count(1)

Change = Callable[[np.ndarray], np.ndarray]


def group() -> dict[str, str]:
    """A bus of nobody else."""
    pid = os.getpid()
    return {"interface": "udp_multicast", "channel": f"239.{100 + next(_GROUPS) % 100}.{pid % 250}.{pid // 250 % 250}"}


def sealed(frames: np.ndarray) -> np.ndarray:
    """The same with right CRCs, where data have been changed; in place."""
    raw = frames.view(np.uint8).reshape(frames.size, fr.FRAME_DTYPE.itemsize)
    offset = fr.FRAME_DTYPE.fields["data"][1]
    for row, frame_id, length in zip(raw, frames["id"].tolist(), frames["length"].tolist(), strict=True):
        payload = row[offset : offset + length].copy()
        e2e_p05_protect(payload.data, identifiers.data_id(frame_id), increment_counter=False)
        row[offset : offset + length] = payload
    return frames


def of(frames: np.ndarray, name: str) -> np.ndarray:
    """Which frames are of one message."""
    return identifiers.message_id(frames["id"]) == codecs.default().messages[name].frame_id


class Said(NamedTuple):
    """One frame of the daemon."""

    name: str
    actuator: int
    values: dict[str, Any]
    at: float  # monotonic [s]


class ActuatorOnBus(threading.Thread):
    """Sends test cycles in real time until stopped; `change` makes of the frames due now what is sent instead."""

    def __init__(self, port: Port, plant: Any, number: int = 0):
        super().__init__(daemon=True)
        self.port, self.change = port, (lambda frames: frames)
        self.cycle = -1  # being sent
        self.n_sent = 0
        fleet = Fleet(Scenario(period=PERIOD, seed=SEED), plant)
        self._cycles = [fleet.next_cycle(np.array([K])) for _ in range(N_DIFFERENT)]
        self.traffic = Traffic(codecs.default(), [number])
        self._ended, self._on = threading.Event(), threading.Event()
        self._on.set()

    def run(self) -> None:
        begin = time.monotonic()
        for number in itertools.count():
            if not self._on.is_set():
                self._on.wait()
                begin = time.monotonic()
            cycle = self._cycles[number % N_DIFFERENT]._replace(number=number, t_start=number * PERIOD)
            frames, due = self.traffic.frames(cycle, PERIOD)
            self.cycle = number
            edges = _CHUNK * np.arange(1, round(PERIOD / _CHUNK))
            for n, part in enumerate(np.split(frames, np.searchsorted(due, edges))):
                wait = begin + n * _CHUNK - time.monotonic()
                if self._ended.wait(max(wait, 0.0)):
                    return
                if self._on.is_set():
                    self.n_sent += self.port.write(self.change(part))
            begin += PERIOD

    def pause(self) -> None:
        """Fall silent."""
        self._on.clear()

    def resume(self) -> None:
        """Go on, with a cycle from its beginning."""
        self._on.set()

    def stop(self) -> None:
        """For good."""
        self._ended.set()
        self._on.set()
        if self.is_alive():
            self.join()


class Attacked:
    """A daemon process in a folder of its own; everything it sends is kept in `said`, in order.

    `before` makes of the bus what the daemon's configuration says of it; `within` is a command that runs another one;
    `settings` are other sections.
    """

    def __init__(self, folder: Path, bundle: Any, before: Any = dict, within: Sequence[str] = (), **settings: Any):
        self.folder, self.log, self.within = folder, folder / "log", within
        self.log.mkdir(parents=True, exist_ok=True)
        self.bus = group()
        self.config = folder / "daemon.yaml"
        plain = {"bus": before(self.bus), "actuators": {0: {"bundle": str(bundle.path)}}, "log": {"directory": "log"}}
        self.config.write_text(yaml.safe_dump(plain | settings))
        self.said: list[Said] = []
        self.stderr = folder / "stderr.txt"
        self.port = open_bus(BusSettings(**self.bus))
        self.actuator = ActuatorOnBus(self.port, bundle.plant)
        self._codec = codecs.default()
        self._ear = open_bus(BusSettings(**self.bus), self._codec.filters("Monitor"))
        self._listening = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self.process: subprocess.Popen | None = None

    def start(self) -> Attacked:
        """Start the process and wait for its first heartbeat."""
        with self.stderr.open("ab") as said:
            self.process = subprocess.Popen([*self.within, EMA, "daemon", "--config", self.config], stderr=said)
        self.until(lambda one: one.name == "Heartbeat")
        return self

    def until(self, found: Callable[[Said], bool]) -> tuple[Said, float]:
        """The first thing said, from now on, that is it; and how long it took. [s]"""
        began, n = time.monotonic(), len(self.said)
        while time.monotonic() < began + PATIENCE:
            for one in self.said[n:]:
                n += 1
                if found(one):
                    return one, max(one.at - began, 0.0)
            if self.process is not None and self.process.poll() is not None:
                raise AssertionError(f"the daemon has ended: {self.stderr.read_text()[-2000:]}")
            time.sleep(0.02)
        said = self.stderr.read_text()[-1500:]
        raise AssertionError(f"not said within {PATIENCE:g} s; last: {self.said[-3:]}; {said}")

    def until_state(self, state: ServiceState, lapse: Lapse | None = None) -> float:
        """Wait for a heartbeat of this state, `lapse` being its gravest reason; seconds until it came."""
        wanted = {"state": state} | ({} if lapse is None else {"reason": lapse})
        return self.until(lambda one: one.name == "Heartbeat" and wanted.items() <= one.values.items())[1]

    def estimates(self, n: int, method: str = "Linear") -> list[Said]:
        """The next `n` estimates."""
        counted: list[Said] = []

        def enough(one: Said) -> bool:
            if one.name == f"Estimate{method}":
                counted.append(one)
            return len(counted) == n

        self.until(enough)
        return counted

    def events(self) -> list[dict[str, Any]]:
        """Events in the log, after the end."""
        with LogReader(self.log) as log:
            return [m.content for m in log.messages(lambda topic: topic == "/event")]

    def signal(self, number: signal.Signals) -> None:
        """To the process."""
        assert self.process
        self.process.send_signal(number)

    def stop(self) -> int:
        """SIGTERM; the exit status."""
        self.actuator.stop()
        assert self.process
        self.process.terminate()
        return self.process.wait(PATIENCE)

    def close(self) -> None:
        """Whatever has become of it."""
        self.actuator.stop()
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._listening.set()
        self._listener.join()
        self._ear.close()
        self.port.close()

    def _listen(self) -> None:
        receiver = Receiver(self._codec)
        while not self._listening.is_set():
            frames = self._ear.read(0.1)
            for message, own in self._codec.split(frames[receiver.check(frames) <= GOOD]):
                values = message.decode(own)
                for row, number in enumerate(identifiers.actuator(own["id"]).tolist()):
                    one = {name: x[row] if x.ndim > 1 else x[row].item() for name, x in values.items()}
                    self.said.append(Said(message.name, number, one, time.monotonic()))


def refusal(*arguments: Any) -> str:
    """What a daemon that does not start says: one line."""
    ran = subprocess.run([EMA, "daemon", *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ran.returncode == 2, ran.stderr
    lines = [line for line in ran.stderr.splitlines() if line and not line.startswith(("Usage:", "Try "))]
    assert len(lines) == 1, ran.stderr
    return lines[0]


def statuses(estimates: list[Said]) -> list[Status]:
    """Of estimates."""
    return [Status(one.values["status"]) for one in estimates]


def reasons(estimate: Said) -> Reason:
    """Of an estimate."""
    return Reason(estimate.values["reason"])
