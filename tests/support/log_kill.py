"""Kill processes that log, at random moments, and see what their logs still hold.

Run as a program (no threads, so that it may fork): `python log_kill.py DIRECTORY TRIALS SEED` prints one JSON line.
"""

import ctypes
import json
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from ema.log import LogReader, LogSettings, LogWriter
from ema.log.recovery import is_sound, recover

INTERVAL = 0.5
AT_ONCE = 10
STEP = 0.004  # [s] between two events


class Told:
    """Numbers in a file that outlives the process, whatever the log does: last and first event, sync, longest stall."""

    LAST, SYNC, STALL, FIRST = 0, 8, 16, 24

    def __init__(self, path):
        self._file = os.open(path, os.O_CREAT | os.O_RDWR)

    def write(self, place, ns):
        os.pwrite(self._file, ns.to_bytes(8, "little"), place)

    def read(self, place):
        return int.from_bytes(os.pread(self._file, 8, place), "little")

    def stalled(self, ns):
        self.write(self.STALL, max(ns, self.read(self.STALL)))


def child(directory):
    told, sync = Told(directory / "last"), os.fdatasync

    def timed(descriptor):
        begun = time.monotonic_ns()
        told.write(told.SYNC, begun)
        sync(descriptor)
        told.write(told.SYNC, 0)
        told.stalled(time.monotonic_ns() - begun)

    os.fdatasync = timed  # a process of its own
    log = LogWriter(directory, {"ema.dbc": b"x" * 1000}, LogSettings(flush_interval=INTERVAL, segment_time=0.8))
    n = 0
    while True:
        t_ns = time.monotonic_ns()
        log.event({"t_ns": t_ns, "level": "info", "code": "n", "text": str(n), "actuator": None})
        told.write(told.LAST, t_ns)
        if n == 0:
            told.write(told.FIRST, t_ns)
        n += 1
        time.sleep(STEP)
        told.stalled(time.monotonic_ns() - t_ns - int(1e9 * STEP))


def _end_with_parent():
    """A trial that fails ends all others: what waits for this program's output would wait for them too."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def survivors(directory):
    """Last time of the events in a log, None without any, after recovery of what is not finished."""
    empty = {path for path in directory.glob("*.mcap") if path.stat().st_size == 0}  # killed as it was begun
    paths = sorted(set(directory.glob("*.mcap")) - empty)
    for path in paths:
        if not is_sound(path):
            recover(path, path.with_suffix(".recovered"))
            path.unlink()
            path.with_suffix(".recovered").rename(path)
    if not paths:
        return None
    with LogReader(directory) as log:
        events = [(int(m.content["text"]), m.t_ns) for m in log.messages()]
        assert {damage.path for damage in log.damage} == empty
    assert [n for n, _ in events] == list(range(len(events))), "a hole in the log"
    return events[-1][1] if events else None


def main(directory, trials, seed):
    rng = np.random.default_rng(seed)
    missing, stalled, segments = [], [], 0
    for batch in range(0, trials, AT_ONCE):
        running = []
        for trial in range(batch, min(batch + AT_ONCE, trials)):
            place = directory / str(trial)
            place.mkdir()
            pid = os.fork()
            if pid == 0:
                _end_with_parent()
                child(place)
            running.append((pid, place, time.monotonic() + rng.uniform(INTERVAL, 4 * INTERVAL)))
        for pid, place, moment in sorted(running, key=lambda run: run[2]):
            time.sleep(max(0.0, moment - time.monotonic()))
            os.kill(pid, signal.SIGKILL)
            killed_ns = time.monotonic_ns()
            os.waitpid(pid, 0)
            segments += len(list(place.glob("*.mcap")))
            told, last_ns = Told(place / "last"), survivors(place)
            kept_ns = told.read(told.FIRST) if last_ns is None else last_ns  # killed so soon that all is missing
            missing.append((told.read(told.LAST) - kept_ns) / 1e9)
            under_way = killed_ns - (told.read(told.SYNC) or killed_ns)
            stalled.append(max(under_way, told.read(told.STALL)) / 1e9)
    result = {"trials": len(missing), "interval": INTERVAL, "segments": segments, "missing": missing}
    print(json.dumps({**result, "stalled": stalled}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
