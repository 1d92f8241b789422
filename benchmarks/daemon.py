"""The daemon as a process beside `ema simulate`: start-up, latency on the bus, frames lost, memory, processor.

    python -m benchmarks.daemon [--bundle var/bundle] [--actuators 1 6] [--turns 16 64] [--cycles 20] [--first]

Both on UDP multicast; a listener of its own hears them. The actuators of one run end their cycles in the same
millisecond, or, of `--turns`, one after the other, as many of them do on several buses. Latency is from a cycle's
CycleEnd, sent right behind its last currents, to its linear estimate, both by the kernel's receive time. It means
little while others use the machine: the load average is printed beside; `--first` (as root) puts daemon, simulator and
listener before all other processes. Processor time is that of the daemon while cycles are sent.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ema.bus import codec as codecs
from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.interface import BusSettings, open_bus
from ema.bus.port import Port

from .identification import quick_bundle
from .rig import EMA, Figures, figures

SEED = 12
N_CYCLES = 20
TURN, ROUNDS = 0.25, 2  # of actuators that take turns: from one's cycle to the next one's [s], and cycles of each
LATENCY = {1: 6.0, 6: 20.0}  # limits, by actuators in step [ms]
MEMORY = 220.0  # limit, of any number of actuators [MB]
_PATIENCE = 60.0  # for the start [s]
PATIENCE_AFTER = 3.0  # for the last estimates, and a heartbeat behind them [s]


def rows(
    bundle: Path | None = None,
    actuators: tuple[int, ...] = (1, 6),
    n_cycles: int = N_CYCLES,
    turns: tuple[int, ...] = (16, 64),
) -> list[dict]:
    """A run for each number of actuators: a test cycle a second, all at the same time; then those that take turns."""
    path = (bundle or quick_bundle().path).resolve()
    found = []
    for n in actuators:
        whose = "one actuator" if n == 1 else f"{n} actuators in step"
        found += _rows(_measured(path, n, n_cycles, {"period": 1.0}), whose, n, n_cycles)
    for n in turns:
        plan = {"stagger": TURN, "period": 1.0 + TURN * (n - 1)}
        found += _rows(_measured(path, n, ROUNDS, plan), f"{n} actuators in turns", n, ROUNDS)
    return found


@dataclass
class _Seen:
    """What one run gave."""

    start_up: float  # [s]
    frames: np.ndarray  # all that was heard from the first cycle on
    before: Figures
    after: Figures
    took: float  # [s]


def _measured(bundle: Path, n_actuators: int, n_cycles: int, plan: dict[str, float]) -> _Seen:
    pid = os.getpid()
    bus = {"interface": "udp_multicast", "channel": f"239.75.{pid % 250}.{pid // 250 % 250}"}
    with tempfile.TemporaryDirectory(prefix="ema-bench-") as name, open_bus(BusSettings(**bus)) as port:
        folder = Path(name)
        (folder / "log").mkdir()
        actuators = {n: {"bundle": str(bundle)} for n in range(n_actuators)}
        daemon = {"bus": bus, "actuators": actuators, "log": {"directory": "log"}}
        who = [{"number": n} for n in actuators]
        scenario = {"bus": bus, "seed": SEED, "n_cycles": n_cycles, "actuators": who, **plan}
        (folder / "daemon.yaml").write_text(yaml.safe_dump(daemon))
        (folder / "scenario.yaml").write_text(yaml.safe_dump(scenario))
        said, began = (folder / "said.txt").open("w"), time.monotonic()
        service = subprocess.Popen([EMA, "daemon", "--config", folder / "daemon.yaml"], stderr=said)
        try:
            _listen(port, service, "Heartbeat", _PATIENCE)
            start_up = time.monotonic() - began
            node = subprocess.Popen(
                [EMA, "simulate", "--scenario", folder / "scenario.yaml"], stderr=subprocess.DEVNULL
            )
            try:
                heard = _listen(port, service, "CycleStart", _PATIENCE)
                before, then = figures(service.pid), time.monotonic()
                while node.poll() is None:
                    heard.append(port.read(0.2))
                after, took = figures(service.pid), time.monotonic() - then
                heard += _listen(port, service, "Heartbeat", PATIENCE_AFTER)
            finally:
                node.kill()
                node.wait()
        except RuntimeError as error:
            raise SystemExit(f"{error}: {(folder / 'said.txt').read_text().strip()}") from error
        finally:
            service.terminate()
            service.wait(_PATIENCE)
            said.close()
    return _Seen(start_up, np.concatenate(heard), before, after, took)


def _listen(port: Port, service: subprocess.Popen[bytes], until: str, patience: float) -> list[np.ndarray]:
    """Frames heard up to the first message of a name."""
    codec, heard, end = codecs.default(), [], time.monotonic() + patience
    while time.monotonic() < end:
        heard.append(port.read(0.1))
        if _of(heard[-1], codec, until).size:
            return heard
        if service.poll() is not None:
            raise RuntimeError("the daemon does not start")
    raise RuntimeError(f"no {until} within {patience:g} s")


def _rows(seen: _Seen, whose: str, n_actuators: int, n_cycles: int) -> list[dict[str, Any]]:
    codec = codecs.default()
    beat = codec.messages["Heartbeat"].decode(_of(seen.frames, codec, "Heartbeat"))
    latency = latencies(seen.frames, codec)
    cpu = (seen.after.cpu - seen.before.cpu) / seen.took
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"

    def row(figure: str, value: float, unit: str, limit: float | None = None) -> dict[str, Any]:
        named = {"figure": f"{whose}: {figure}", "value": round(float(value), 3), "unit": unit}
        return {**named, "limit": limit, "peer": "", "peer_value": None, "seed": SEED}

    return [
        row("cycles without an estimate", n_actuators * n_cycles - latency.size, "1", 0),
        row("frames lost, by the heartbeat", beat["n_lost"][-1], "1", 0),
        row("frames the kernel dropped", beat["kernel_drops"][-1], "1", 0),
        row("frames on the bus", seen.frames.size / seen.took, "1/s"),
        row(f"latency of the linear estimate, median ({load})", np.median(latency), "ms"),
        row("latency of the linear estimate, 99 %", np.percentile(latency, 99), "ms", LATENCY.get(n_actuators)),
        row("latency of the linear estimate, most", latency.max(), "ms"),
        row("processor for each actuator", 100 * cpu / n_actuators, "% of a core", 10),
        row(f"resident memory, {seen.after.n_threads} threads", seen.after.rss / 1e6, "MB", MEMORY),
        row("start to first heartbeat", seen.start_up, "s"),
    ]


def _of(frames: np.ndarray, codec: Codec, name: str) -> np.ndarray:
    return frames[identifiers.message_id(frames["id"]) == codec.messages[name].frame_id]


def latencies(frames: np.ndarray, codec: Codec) -> np.ndarray:
    """From CycleEnd to EstimateLinear, of each cycle. [ms]"""
    times: dict[str, dict[tuple[int, int], int]] = {}
    for name in ("CycleEnd", "EstimateLinear"):
        own = _of(frames, codec, name)
        cycles = codec.messages[name].decode(own)["cycle"].tolist()
        keys = zip(identifiers.actuator(own["id"]).tolist(), cycles, strict=True)
        times[name] = dict(zip(keys, own["t_ns"].tolist(), strict=True))
    answered = times["EstimateLinear"].keys() & times["CycleEnd"].keys()
    return np.array([(times["EstimateLinear"][key] - times["CycleEnd"][key]) / 1e6 for key in answered])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, help="folder written by `ema build`; default: a quick one, cached")
    parser.add_argument("--actuators", type=int, nargs="+", default=[1, 6])
    parser.add_argument("--turns", type=int, nargs="*", default=[])
    parser.add_argument("--cycles", type=int, default=N_CYCLES)
    parser.add_argument("--first", action="store_true", help="before all other processes; needs root")
    arguments = parser.parse_args()
    if arguments.first:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))  # inherited by daemon and simulator
    for found in rows(arguments.bundle, tuple(arguments.actuators), arguments.cycles, tuple(arguments.turns)):
        limit = "" if found["limit"] is None else f"   (at most {found['limit']})"
        print(f"{found['figure']:75} {found['value']:10} {found['unit']}{limit}")
