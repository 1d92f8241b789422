"""SIGKILL at a random moment, many times, into a daemon that works and logs; what its logs hold afterwards.

    python -m benchmarks.kills --trials 20 --bundle BUNDLE

Each trial starts the daemon in the same log directory, sends it cycles and kills it. Printed is how much of what the
bus had carried before each kill is not in the log: it has to be less than the flush interval.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ema.log import LogReader

from .rig import PERIOD, Rig

INTERVAL = 1.0  # flush interval [s]
PACE = 0.4  # a cycle is sent in this time [s]


class Trial(NamedTuple):
    """What was found after one kill."""

    missing: float  # time between the last logged frame and the last one sent before the kill [s]
    n_estimates: int  # heard before the kill
    n_estimates_missing: int  # of those, not in the log


def trial(rig: Rig, first_cycle: int, lifetime: float) -> Trial:
    """Start, send cycles for `lifetime` [s], kill, and read the newest segment."""
    rig.start()
    end, number, heard, last_ns = time.monotonic() + lifetime, first_cycle, [], 0
    while time.monotonic() < end:
        last_ns = rig.send(number, PACE)
        heard += [cycle for cycle, _ in rig.answers(0.1)]
        number += 1
    rig.kill()
    written = (path for path in rig.log.glob("*.mcap") if path.stat().st_size)  # but for one killed as it was begun
    newest = max(written, key=lambda path: path.stat().st_mtime_ns)
    with LogReader(newest) as log:
        logged_ns = max((int(frames["t_ns"][-1]) for _, frames in log.frames()), default=0)
        logged = {m.content["cycle"] for m in log.messages(lambda topic: topic == "/estimate/0/linear")}
    return Trial((last_ns - logged_ns) / 1e9, len(heard), len(set(heard) - logged))


def trials(rig: Rig, n: int, seed: int) -> list[Trial]:
    """`n` trials with random lifetimes of one to three seconds."""
    rng = np.random.default_rng(seed)
    return [trial(rig, 100 * index, float(rng.uniform(1, 3) * PERIOD)) for index in range(n)]


def summary(rig: Rig, results: list[Trial]) -> str:
    """One line; reads the whole directory once more, as a person would afterwards."""
    with LogReader(rig.log) as log:
        n_frames = sum(len(frames) for _, frames in log.frames())
        n_damaged, n_open = len(log.damage), len(log.unfinished)
    missing = [result.missing for result in results]
    return (
        f"SIGKILL into the daemon: {len(results)} trials, {n_open} segments left open, all readable "
        f"({n_frames} frames, {n_damaged} damaged); not in the log: at most the last {max(missing):.3f} s "
        f"(median {np.median(missing):.3f} s, flush interval {INTERVAL:g} s), "
        f"{sum(r.n_estimates_missing for r in results)} of {sum(r.n_estimates for r in results)} estimates heard"
    )


def main() -> int:
    """Read the arguments, run, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bundle", type=Path, required=True, help="folder written by `ema build`")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ema-kills-") as folder:
        with Rig(Path(folder), arguments.bundle, flush_interval=INTERVAL) as rig:
            results = trials(rig, arguments.trials, arguments.seed)
        print(summary(rig, results))
    return int(max(result.missing for result in results) > INTERVAL)


if __name__ == "__main__":
    sys.exit(main())
