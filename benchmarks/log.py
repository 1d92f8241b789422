"""Logs: what a frame costs to write and to read, beside python-can's BLF; recorded cycles identified again."""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import numpy as np
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema.bundle import Bundle
from ema.bus.codec import Codec
from ema.core import can_messages, config, resources
from ema.log import LogReader, LogSettings
from ema.log.segmented import SegmentedLog
from ema.models.actuator import Actuator

from .identification import quick_bundle
from .rig import EMA

SEED = 31
N_SHORT, N_LONG = 30, 120  # cycles
DAY = 86_400  # cycles of one actuator in a day, one each second
PEER = "python-can, BLF"


def rows() -> list[dict[str, Any]]:
    """CPU time, so that other work on the machine does not count."""
    flight = _flight()
    bundle = quick_bundle()
    with tempfile.TemporaryDirectory() as name:
        short, long, blf = Path(name) / "short", Path(name) / "long", Path(name) / "x.blf"
        n = sum(map(len, flight[:N_SHORT]))
        write, read = _cpu(lambda: _write(flight[:N_SHORT], short)) / n, _cpu(lambda: _read(short)) / n
        n_peer = sum(map(len, flight[:3]))
        peer_write = _cpu(lambda: _write_blf(flight[:3], blf)) / n_peer
        peer_read = _cpu(lambda: sum(1 for _ in can.LogReader(blf))) / n_peer
        _write(flight, long)
        (cpu_short, memory_short), (cpu_long, memory_long) = (_identify(log, bundle) for log in (short, long))
        again = (cpu_long - cpu_short) / (N_LONG - N_SHORT)
        size = sum(path.stat().st_size for path in short.iterdir()) / n
        found = [
            ("log: write a frame", 1e6 * write, "µs of CPU", 1e6 * peer_write),
            ("log: read a frame", 1e6 * read, "µs of CPU", 1e6 * peer_read),
            ("log: size of a frame", size, "B", blf.stat().st_size / n_peer),
            ("replay --identify: cycles (linear, LF2 every 5 s)", 1 / again, "1/s of CPU", None),
            ("  a day of one actuator, a cycle each second, one core", DAY * again / 60, "min of CPU", None),
            (f"  memory more for {N_LONG} cycles than for {N_SHORT}", memory_long - memory_short, "MB", None),
        ]
    return [
        {"figure": what, "value": round(value, 2), "unit": unit, "seed": SEED}
        | ({"peer": PEER, "peer_value": round(peer, 2)} if peer is not None else {})
        for what, value, unit, peer in found
    ]


def _flight() -> list[np.ndarray]:
    """Frames of each cycle of one actuator."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    scenario = Scenario.model_validate({"seed": SEED, "actuators": [{"number": 0}]})
    fleet, traffic = Fleet(scenario, plant), Traffic(Codec(), [0])
    cycles = []
    for number in range(N_LONG):
        frames, due = traffic.frames(fleet.next_cycle(np.zeros((1, 6))), scenario.period)
        frames["t_ns"] = 10**18 + ((number * scenario.period + due) * 1e9).astype(np.uint64)
        cycles.append(frames)
    return cycles


def _write(flight: list[np.ndarray], directory: Path) -> None:
    directory.mkdir()
    log = SegmentedLog(directory, {}, LogSettings(keep_free=0), 10**18, 0.0)
    for second, frames in enumerate(flight):
        for begin in range(0, len(frames), 30):
            log.frames(frames[begin : begin + 30], "vcan0")
        log.tick(10**18, second + 1.0)
    log.close()


def _read(directory: Path) -> None:
    with LogReader(directory) as log:
        for _ in log.frames():
            pass


def _write_blf(flight: list[np.ndarray], path: Path) -> None:
    with can.Logger(path) as log:
        for frames in flight:
            for frame in frames:
                log(can_messages.message(frame))


def _identify(directory: Path, bundle: Bundle) -> tuple[float, float]:
    """CPU time [s] and largest memory [MB] of `ema replay --identify`."""
    command = [EMA, "replay", directory, "--identify", "--bundle", bundle.path]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"ema replay ended with {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def _cpu(work: Callable[[], Any]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began
