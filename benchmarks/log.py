"""Logs: what a frame costs to write and to read, beside python-can's BLF; recorded cycles identified again."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import can
import numpy as np
from ema_postflight.received import received
from ema_simulator.fleet import Fleet
from ema_simulator.scenario import Scenario
from ema_simulator.traffic import Traffic

from ema.bundle import Bundle
from ema.bus.codec import Codec
from ema.core import can_messages, config, resources
from ema.log import LogReader, LogSettings
from ema.log.segmented import SegmentedLog
from ema.models.actuator import Actuator
from ema.monitor import MonitorSettings

from .identification import quick_bundle
from .rig import EMA

SEED = 31
N_DIFFERENT = 8  # simulated cycles, repeated under new numbers
N_SHORT, N_LONG = 100, 1000  # cycles
DAY = 172_800  # cycles of half a second in a day
PEER = "python-can, BLF"


def rows() -> list[dict[str, Any]]:
    """CPU time, so that other work on the machine does not count, except where wall clock is said."""
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
        one, two = ([_identify(log, bundle, n_processes) for log in (short, long)] for n_processes in (1, 2))
        reading = _cpu(lambda: _receive(long, bundle)) / N_LONG
        size, peer_size = (sum(map(_bytes, paths)) for paths in (short.iterdir(), [blf]))
    n_more = N_LONG - N_SHORT
    cpu, wall = (one[1].cpu - one[0].cpu) / n_more, (two[1].wall - two[0].wall) / n_more
    busier = max(reading, cpu - reading)
    found = [
        ("log: write a frame", 1e6 * write, "µs of CPU", 1e6 * peer_write),
        ("log: read a frame", 1e6 * read, "µs of CPU", 1e6 * peer_read),
        ("log: size of a frame", size / n, "B", peer_size / n_peer),
        ("replay --identify: a cycle (linear, LF2 every 5 s)", 1e3 * cpu, "ms of CPU", None),
        ("  of it the process that reads", 1e3 * reading, "ms of CPU", None),
        ("  cycles on one core", 1 / cpu, "1/s of CPU", None),
        ("  cycles on two cores: by the busier process", 1 / busier, "1/s of CPU", None),
        ("  cycles by two processes on this machine as busy as it is", 1 / wall, "1/s, wall clock", None),
        (f"  a day of one actuator ({DAY} cycles), two cores", DAY * busier / 60, "min of CPU", None),
        (f"  largest process for {N_SHORT} cycles", two[0].memory, "MB", None),
        (f"  largest process for {N_LONG} cycles", two[1].memory, "MB", None),
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
    made = [fleet.next_cycle(np.zeros((1, 6))) for _ in range(N_DIFFERENT)]
    flight = []
    for number in range(N_LONG):
        cycle = made[number % N_DIFFERENT]._replace(number=number, t_start=number * scenario.period)
        frames, due = traffic.frames(cycle, scenario.period)
        frames["t_ns"] = 10**18 + ((number * scenario.period + due) * 1e9).astype(np.uint64)
        flight.append(frames)
    return flight


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


# Between this process and the command, because a process's largest memory begins as that of the one it is forked from.
_CHILD = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
"""


class _Used(NamedTuple):
    """Of all processes: CPU time [s]; of the largest: memory [MB]; and time by the clock [s]."""

    cpu: float
    memory: float
    wall: float


def _identify(directory: Path, bundle: Bundle, n_processes: int) -> _Used:
    """What `ema replay --identify` uses."""
    command = [
        str(EMA),
        "replay",
        str(directory),
        "--identify",
        "--bundle",
        str(bundle.path),
        "--processes",
        str(n_processes),
    ]
    began = time.monotonic()
    said = subprocess.run([sys.executable, "-c", _CHILD, *command], check=True, capture_output=True, text=True).stdout
    cpu, kilobytes = map(float, said.split())
    return _Used(cpu, kilobytes / 1e3, time.monotonic() - began)


def _receive(directory: Path, bundle: Bundle) -> None:
    with LogReader(directory) as log:
        for _ in received(log, {0: bundle}, MonitorSettings(), ()):
            pass


def _bytes(path: Path) -> int:
    return path.stat().st_size


def _cpu(work: Callable[[], Any]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began
