"""Time stamps that vary: were the samples taken at these times, or evenly and stamped late?

A motion is smooth over the times at which it was sampled. Where it is smoother over even times, the stamps jitter (a
logger's or a bus's), and not the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.records import Array, Cycle

from .smooth import local_polynomial

VARIES = 0.01  # of the period: less is rounding of the stamps
HALF, DEGREE = 7, 3
BLOCKS, CLEAR = 16, 3.0  # parts of the record, and deviations over them by which one is smoother
GAP = 5.0  # periods that are no jitter


@dataclass(frozen=True)
class Stamps:
    """Of one cycle: rms by which stamps differ from even times [s], and which the motion is smoother over.

    By how steps vary from one to the next: a rate that drifts adds up to far more, and is no jitter.
    """

    jitter: float
    samples: str  # "as stamped", "even" or "either"


def examine_stamps(cycle: Cycle, channel: str) -> Stamps:
    """What a smooth `channel` (an angle, or a speed) says of the time stamps."""
    t, x = cycle["t"], cycle[channel]
    step = np.diff(t)
    period = float(np.median(step))
    if len(t) < 4 * HALF * BLOCKS or float(step.max()) > GAP * period or float(np.std(step)) < VARIES * period:
        return Stamps(0.0, "either")
    n = np.arange(len(t))
    even = np.asarray(np.polyval(np.polyfit(n, t, 1), n), np.float64)
    jitter = float(np.std(step)) / np.sqrt(2.0)
    more = np.log(_roughness(t, x) / _roughness(even, x))
    spread = float(np.std(more)) / np.sqrt(BLOCKS)
    mean = float(np.mean(more))
    if abs(mean) < CLEAR * spread:
        return Stamps(jitter, "either")
    return Stamps(jitter, "even" if mean > 0.0 else "as stamped")


def _roughness(t: Array, x: Array) -> Array:
    """Mean square of what a local cubic leaves, by part of the record."""
    left = (x - local_polynomial(t, x, HALF, DEGREE)[0]) ** 2
    return np.array([part.mean() for part in np.array_split(left, BLOCKS)]) + np.finfo(float).tiny


def describe(name: str, cycles: tuple[Cycle, ...], channel: str) -> list[str]:
    """One sentence for a record whose stamps vary; empty where they are even."""
    found = [examine_stamps(c, channel) for c in cycles]
    clear = [s for s in found if s.samples != "either"]
    if not clear:
        return []
    jitter = float(np.sqrt(np.mean([s.jitter**2 for s in clear])))
    if all(s.samples == "even" for s in clear):
        return [
            f"{name}: time stamps jitter by {jitter:.2g} s rms, and {channel} is smoother over even times: the samples "
            "were taken evenly and stamped late or early; give them even times"
        ]
    if all(s.samples == "as stamped" for s in clear):
        return [
            f"{name}: sampling times vary by {jitter:.2g} s rms from step to step; they are taken as they are stamped"
        ]
    return []
