"""Six actuators at real time on one bus, one daemon: frames lost, latency, processor time, memory.

    python -m benchmarks.six --bundle BUNDLE --cycles 20

Two processes, `ema simulate` and `ema daemon`, on UDP multicast; this one listens. Latency is the time from a cycle's
last frame to its linear estimate, as the kernel sees both arrive here.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.interface import BusSettings, open_bus
from ema.bus.port import Port

from .rig import EMA, figures

N_ACTUATORS = 6
SEED = 12
N_CYCLES = 20
_PATIENCE = 60.0  # for the start, and for the last estimates [s]


def rows(bundle: Path, n_cycles: int = N_CYCLES) -> list[dict[str, Any]]:
    """Figures of one run of `n_cycles` test cycles of each actuator, one a second."""
    with tempfile.TemporaryDirectory(prefix="ema-six-") as folder:
        return _run(Path(folder), bundle.resolve(), n_cycles)


def _run(folder: Path, bundle: Path, n_cycles: int) -> list[dict[str, Any]]:
    bus = {"interface": "udp_multicast", "channel": f"239.74.{os.getpid() % 250}.6"}
    (folder / "log").mkdir()
    actuators = {n: {"bundle": str(bundle)} for n in range(N_ACTUATORS)}
    daemon = {"bus": bus, "actuators": actuators, "log": {"directory": "log"}}
    scenario = {"bus": bus, "seed": SEED, "n_cycles": n_cycles, "actuators": [{"number": n} for n in actuators]}
    (folder / "daemon.yaml").write_text(yaml.safe_dump(daemon))
    (folder / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    with open_bus(BusSettings(**bus)) as port:
        heard = _Heard(port)
        began = time.monotonic()
        service = subprocess.Popen([EMA, "daemon", "--config", folder / "daemon.yaml"])
        try:
            heard.listen(lambda: heard.heartbeat is not None, _PATIENCE)
            start_up = time.monotonic() - began
            before, then = figures(service.pid), time.monotonic()
            node = subprocess.Popen(
                [EMA, "simulate", "--scenario", folder / "scenario.yaml"], stderr=subprocess.DEVNULL
            )
            try:
                heard.listen(lambda: len(heard.latency) >= n_cycles * N_ACTUATORS, n_cycles + _PATIENCE)
                now, took = figures(service.pid), time.monotonic() - then
                heard.heartbeat = None
                heard.listen(lambda: heard.heartbeat is not None, 3.0)
            finally:
                node.kill()
                node.wait()
        finally:
            service.terminate()
            service.wait(_PATIENCE)
    beat = heard.heartbeat or {}
    cpu = (now.cpu - before.cpu) / took
    latency = 1e3 * np.array(heard.latency or [np.nan])

    def row(figure: str, value: float, unit: str, limit: float | None = None) -> dict[str, Any]:
        named = {"figure": f"six actuators, one daemon: {figure}", "value": round(float(value), 3), "unit": unit}
        return {**named, "limit": limit, "peer": "", "peer_value": None, "seed": SEED}

    return [
        row("cycles sent without an estimate", n_cycles * N_ACTUATORS - len(heard.latency), "1", 0),
        row("frames lost, by the daemon's heartbeat", beat.get("n_lost", np.nan), "1", 0),
        row("frames the kernel dropped", beat.get("kernel_drops", np.nan), "1", 0),
        row("frames on the bus in a cycle", heard.n_frames / max(took, 1e-9), "1/s"),
        row("latency of the linear estimate, median", np.median(latency), "ms"),
        row("latency of the linear estimate, 99 %", np.percentile(latency, 99), "ms", 10),
        row("processor time for each actuator", 100 * cpu / N_ACTUATORS, "% of a core", 10),
        row("resident memory", now.rss / 1e6, "MB", 200),
        row("start to first heartbeat", start_up, "s"),
    ]


class _Heard:
    """What went over the bus."""

    def __init__(self, port: Port):
        self._port, self._codec = port, Codec()
        self._last_ns: dict[int, int] = {}  # of each actuator's current frames
        self.latency: list[float] = []  # [s]
        self.heartbeat: dict[str, float] | None = None
        self.n_frames = 0

    def listen(self, done: Any, patience: float) -> None:
        """Until `done()` or patience ends."""
        end = time.monotonic() + patience
        while not done() and time.monotonic() < end:
            frames = self._port.read(0.1)
            self.n_frames += frames.size
            for message, part in self._codec.split(frames):
                numbers, times = identifiers.actuator(part["id"]).tolist(), part["t_ns"].tolist()
                if message.name == "PhaseCurrents":
                    self._last_ns.update(zip(numbers, times, strict=True))
                elif message.name == "EstimateLinear":
                    pairs = zip(numbers, times, strict=True)
                    self.latency += [(t_ns - self._last_ns[n]) / 1e9 for n, t_ns in pairs]
                elif message.name == "Heartbeat":
                    self.heartbeat = {name: float(value[-1]) for name, value in message.decode(part).items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, required=True, help="folder written by `ema build`")
    parser.add_argument("--cycles", type=int, default=N_CYCLES)
    arguments = parser.parse_args()
    for found in rows(arguments.bundle, arguments.cycles):
        limit = "" if found["limit"] is None else f"   (at most {found['limit']})"
        print(f"{found['figure']:70} {found['value']:10} {found['unit']}{limit}")
