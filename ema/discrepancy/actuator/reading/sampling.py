"""Positions that come less often than currents, as on the bus: a record holds straight lines between them."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import UnivariateSpline

from ema.core.records import Array

RATES = (50, 40, 25, 20, 10, 8, 5, 4, 2)  # samples from one position to the next
STRAIGHT = 1e-9  # [rad] by which a line may be bent by rounding
KNOTS = 0.2  # least share of the knots where a moving rotor bends the line


def positions_every(theta_m: Array) -> int:
    """Samples from one recorded rotor position to the next, if it goes in straight lines between them; else 1."""
    bent = np.flatnonzero(np.abs(np.diff(theta_m, 2)) > STRAIGHT) + 1
    for n in RATES:
        if len(bent) > KNOTS * len(theta_m) / n and not (bent % n).any():
            return n
    return 1


def straighten(x: Array, every: int) -> Array:
    """Signals (n, n_times) as such a record has them: straight lines between every so many samples."""
    if every == 1:
        return x
    t = np.arange(x.shape[1])
    knots = t[::every]
    return np.array([np.interp(t, knots, row[::every]) for row in x])


def between(command: Array, every: int, step: float) -> Array:
    """What the controller has followed (n_times,): a curve as smooth as the resolution `step` of its samples allows."""
    if every == 1:
        return command
    knots = np.arange(0, len(command), every)
    curve = UnivariateSpline(knots, command[knots], k=5, s=len(knots) * step**2 / 12.0)
    return np.asarray(curve(np.arange(len(command))))
