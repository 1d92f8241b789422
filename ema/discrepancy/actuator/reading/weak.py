"""The residual torque as a function of angle, speed and position: where to look, found without simulating.

In weak form (averages over triangles, see `features`) a torque the nominal balance does not know stands in the
residual as it is, wherever the shaft moves. So a torque line shows its order, and a tight stretch its place, before
any of it is simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ema.core.records import Array

from .features import GROUPS, SETTLING, Signals, local_mean, spacing

ORDERS = np.arange(1.0, 120.0, 0.1)
N_LINES = N_STRETCHES = 2  # that are proposed
MOVING = 2.0  # [rad/s] below, dry friction takes up what it likes


@dataclass(frozen=True)
class Torque:
    """Residual torque of one cycle at the nodes, with the signals it may depend on.

    Attributes
    ----------
    r, sd : arrays, shape (n_nodes,)
        Residual and its noise. [N m]
    theta_m, w_m, theta_u : arrays, shape (n_times,)
    current : array, shape (n_nodes,)
        DC-equivalent motor current. [A]
    m : int
        Samples between nodes.
    skip : int
        Nodes left out at the start.
    """

    r: Array
    sd: Array
    theta_m: Array
    w_m: Array
    theta_u: Array
    current: Array
    m: int
    skip: int

    def averaged(self, x: Array) -> Array:
        """Local averages of a function of the signals (..., n_times) at the nodes."""
        return local_mean(x, self.m)[..., self.skip :]


def torque(signals: Signals, r: Array, sd: Array, rate: float) -> Torque:
    """Residual of one cycle with its signals."""
    n_times = signals.theta_m.shape[1]
    m = spacing(GROUPS["torque"][0], rate, n_times)
    smooth = np.convolve(np.gradient(signals.theta_m[0]) * rate, np.ones(21) / 21.0, "same")
    skip = round(SETTLING * rate) // m
    current = local_mean(0.5 * np.abs(signals.i[0]).sum(axis=0), m)[skip:]
    return Torque(r, sd, signals.theta_m[0], smooth, signals.theta_u[0], current, m, skip)


def share_explained(cycles: Sequence[Torque], terms: Callable[[Torque], Array]) -> tuple[float, Array]:
    """Share of the weighted residual that a few terms (n_terms, n_times) can take, and their coefficients."""
    A, b = [], []
    for c in cycles:
        weight = (np.abs(c.averaged(c.w_m)) > MOVING) / c.sd
        A.append(c.averaged(terms(c)) * weight)
        b.append(c.r * weight)
    X, y = np.concatenate(A, axis=1).T, np.concatenate(b)
    total = float(y @ y)
    if total == 0.0:
        return 0.0, np.zeros(X.shape[1])
    coefficients, *_ = np.linalg.lstsq(X, y, rcond=1e-9)
    left = y - X @ coefficients
    return 1.0 - float(left @ left) / total, np.asarray(coefficients, dtype=float)


def line(order: float) -> Callable[[Torque], Array]:
    """A torque line."""
    return lambda c: np.stack([np.cos(order * c.theta_m), np.sin(order * c.theta_m)])


def bump(centre: float, width: float) -> Callable[[Torque], Array]:
    """Friction higher around a position."""
    return lambda c: (np.sign(c.w_m) * np.exp(-(((c.theta_u - centre) / width) ** 2)))[None]


class ShownLine(NamedTuple):
    """A torque line  a cos nθ + b sin nθ  [N m] that opposes positive motion, and the share of the rest it takes."""

    order: float
    share: float
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        """Of the line. [N m]"""
        return float(np.hypot(self.cosine, self.sine))


class ShownStretch(NamedTuple):
    """A stretch of the travel, centre and width [rad], and by how much friction is higher in its middle. [N m]"""

    centre: float
    width: float
    height: float


def lines(cycles: Sequence[Torque]) -> list[ShownLine]:
    """The `N_LINES` strongest torque lines; peaks are at least 0.7 orders apart."""
    tried = [(order, *share_explained(cycles, line(order))) for order in ORDERS]
    found: list[ShownLine] = []
    for order, share, (cosine, sine) in sorted(tried, key=lambda entry: -entry[1]):
        if all(abs(order - other.order) >= 0.7 for other in found):
            found.append(ShownLine(float(order), float(share), float(cosine), float(sine)))
        if len(found) == N_LINES:
            break
    return found


def bumps(cycles: Sequence[Torque]) -> list[ShownStretch]:
    """The `N_STRETCHES` likeliest stretches of changed friction."""
    low, high = min(c.theta_u.min() for c in cycles), max(c.theta_u.max() for c in cycles)
    grid = [(float(c), w) for c in np.linspace(low, high, 31) for w in (5e-4, 1e-3, 2e-3, 4e-3)]
    tried = [(*at, *share_explained(cycles, bump(*at))) for at in grid]
    found: list[ShownStretch] = []
    for c, w, _, (height,) in sorted(tried, key=lambda entry: -entry[2]):
        if all(abs(c - other.centre) > max(w, other.width) for other in found):
            found.append(ShownStretch(c, w, float(height)))
        if len(found) == N_STRETCHES:
            break
    return found
