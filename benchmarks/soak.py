"""A day in a hurry: as many test cycles as a day has, as fast as this machine takes them, through one daemon process.

    python -m benchmarks.soak --cycles 86400

Prints memory, files, threads, processor time and latency on the way; at the end memory's slope and latency's drift over
the second half. Ends with 1 if an estimate is missing, files or threads grew, or memory did.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .rig import Figures, Rig, figures

DAY = 86_400  # cycles, one a second
IN_FLIGHT = 2  # cycles sent and not answered yet
PATIENCE = 30.0  # for an answer [s]
MOST_GROWTH = 2_000_000  # of memory over the second half [B]
WARM = 1_000  # cycles; in shorter runs buffers and allocator are still growing to their size, and memory is not judged


@dataclass
class Soak:
    """What was seen."""

    n_sent: int = 0
    latency: list[float] = field(default_factory=list)  # of each answered cycle [s]
    samples: list[tuple[int, Figures]] = field(default_factory=list)  # with the number of cycles answered

    def growth(self) -> float:
        """Memory's growth over the second half, from a straight line through it. [B]"""
        half = self.samples[len(self.samples) // 2 :]
        n, rss = np.array([n for n, _ in half]), np.array([f.rss for _, f in half])
        return float(np.polyfit(n, rss, 1)[0] * (n[-1] - n[0]))

    def slope(self) -> float:
        """Memory's growth per 1 000 cycles, over the second half. [B]"""
        half = self.samples[len(self.samples) // 2 :]
        return self.growth() / (half[-1][0] - half[0][0]) * 1000

    def cost(self, begin: float, end: float) -> float:
        """The daemon's processor time for a cycle, within these shares of the run. [s]"""
        part = self.samples[int(begin * len(self.samples)) : max(2, round(end * len(self.samples)))]
        (n_first, first), (n_last, last) = part[0], part[-1]
        return (last.cpu - first.cpu) / (n_last - n_first)

    def faults(self) -> list[str]:
        """What is not as it should be."""
        first, last = self.samples[len(self.samples) // 2][1], self.samples[-1][1]
        found = []
        if len(self.latency) < self.n_sent:
            found.append(f"{self.n_sent - len(self.latency)} estimates are missing")
        if last.n_files > first.n_files or last.n_threads > first.n_threads:
            found.append(f"files {first.n_files} → {last.n_files}, threads {first.n_threads} → {last.n_threads}")
        if self.n_sent >= WARM and self.growth() > MOST_GROWTH:
            found.append(f"memory grew by {self.growth() / 1e6:.1f} MB over the second half")
        return found


def soak(rig: Rig, n_cycles: int, every: int) -> Soak:
    """Send `n_cycles` through a running daemon; a line for each `every` cycles."""
    seen, sent = Soak(), {}
    began = time.monotonic()
    while len(seen.latency) < n_cycles:
        while seen.n_sent < n_cycles and len(sent) < IN_FLIGHT:
            sent[seen.n_sent] = rig.send(seen.n_sent)
            seen.n_sent += 1
        answers = rig.answers(PATIENCE)
        if not answers:
            break
        for cycle, t_ns in answers:
            seen.latency.append((t_ns - sent.pop(cycle)) / 1e9)
            if len(seen.latency) % every == 0:
                seen.samples.append((len(seen.latency), figures(rig.pid)))
                print(_line(seen, every, time.monotonic() - began), flush=True)
    return seen


def _line(seen: Soak, every: int, elapsed: float) -> str:
    n, now = seen.samples[-1]
    middle, high = 1e3 * np.percentile(seen.latency[-every:], [50, 99])
    return (
        f"{n:7d} cycles, {n / elapsed:5.1f}/s; RSS {now.rss / 1e6:6.1f} MB, {now.n_files} files, "
        f"{now.n_threads} threads, CPU {1e3 * now.cpu / n:.2f} ms a cycle; latency {middle:.1f} ms, 99 %: {high:.1f} ms"
    )


def main() -> int:
    """Read the arguments, run, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cycles", type=int, default=DAY)
    parser.add_argument("--bundle", type=Path, required=True, help="folder written by `ema build`")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ema-soak-") as folder:
        kept = {"segment_size": 50, "keep_segments": 4}
        with Rig(Path(folder), arguments.bundle, **kept) as rig:
            rig.start()
            seen = soak(rig, arguments.cycles, max(1, arguments.cycles // 40))
            status = rig.stop()
        n_segments = len(list(rig.log.glob("*.mcap")))
    tenth = max(1, len(seen.latency) // 10)
    before, after = (1e3 * float(np.median(part)) for part in (seen.latency[:tenth], seen.latency[-tenth:]))
    cost = [1e3 * seen.cost(*share) for share in ((0.0, 0.5), (0.5, 1.0))]
    faults = seen.faults() + ([f"the daemon ended with {status}"] if status else [])
    print(
        f"{len(seen.latency)} of {seen.n_sent} cycles estimated; memory's growth over the second half "
        f"{seen.growth() / 1e6:+.2f} MB ({seen.slope() / 1e3:+.2f} kB per 1000 cycles); processor time for a cycle "
        f"{cost[0]:.2f} ms in the first half, {cost[1]:.2f} ms in the second; "
        f"latency {before:.1f} ms in the first tenth, {after:.1f} ms in the last; "
        f"{n_segments} segments kept; {'; '.join(faults) or 'all constant'}"
    )
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
