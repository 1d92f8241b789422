"""How wide a test function must be for the acceleration to be seen, and that acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array
from ema.discrepancy.axis.reading.smooth import bumps_at

from .course import Course

HALVES = (4, 6, 9, 13, 20, 30, 45, 70, 100, 150, 220, 330)  # of a test function, in samples
QUIET = 0.1  # noise of the acceleration over its rms from which a test function is wide enough
STILL = 0.02  # noise of the torque that the inertia needs, over the drive's, from which it is
LONGEST = 20.0  # test functions that a record has room for, at least


def half_widths(courses: list[Course], inertia: float = 0.0, drive: float = 0.0) -> dict[str, float]:
    """By record, the narrowest test function over which the acceleration is clearly seen. [s]

    With the rms of the drive's torque, and the inertia, also the torque that it needs.
    """
    out: dict[str, float] = {}
    for record in dict.fromkeys(c.record for c in courses if not c.static):
        own = [c for c in courses if c.record == record]
        period = float(np.median([c.period for c in own]))
        longest = max(float(np.ptp(c.t)) for c in own)
        for half in HALVES:
            out[record] = (half + 0.5) * period
            found, noise = zip(*(_at_places(c, out[record]) for c in own), strict=True)
            seen, noise_ = (float(np.mean(np.concatenate(x) ** 2)) for x in (found, noise))
            if noise_ < QUIET**2 * seen and inertia**2 * noise_ <= (STILL * drive) ** 2:
                break
            if LONGEST * out[record] > longest:
                break
    return out


def _at_places(c: Course, half: float) -> tuple[Array, Array]:
    """∫ φ dω/dt and its noise, at about a hundred places."""
    step = max(1, len(c.t) // 100)
    index, _, first, second, whole = bumps_at(c.t, np.arange(0, len(c.t), step), half)
    value, noise = acceleration(c, index, first, second)
    return value[whole], noise[whole]


def acceleration(c: Course, index: NDArray[np.int_], first: Array, second: Array) -> tuple[Array, Array]:
    """Acceleration from the position or, where that is quieter by far, from the speed; and its noise."""
    out = []
    for x, weights, role in ((c.position, second, "position"), (c.speed, first, "speed")):
        if x is not None:
            noise = c.noise.get(role, 0.0) * np.sqrt((weights**2).sum(axis=1))
            centre = x[index[:, :1]]  # sums of large numbers lose digits
            out.append((((x[index] - centre) * weights).sum(axis=1), noise))
    if len(out) == 2 and np.median(out[1][1]) > 0.2 * np.median(out[0][1]):
        return out[0]  # the position is what the axis did; a drive's speed is often late
    return out[-1]
