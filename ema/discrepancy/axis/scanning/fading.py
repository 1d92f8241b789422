"""Friction that falls with speed: the torque residual says over which speed; a fit from anywhere else goes astray.

Falling friction lets deviations grow, so fits that begin with another speed end in side minima.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry
from ema.effects.stribeck import fade

from .weak_form import FEWEST, Weak, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured
    from ema.effects.search import AxisSizes

NAME = "stribeck"
SPEEDS = np.geomspace(0.02, 1.0, 12)  # of the rms speed
SHAPES = (-1.0, 0.0, 0.5, 1.0)
HIGHEST = 3.0  # excess
LEAST = 1e-3  # of a column that must be left beside the others
N_STARTS = 4


@dataclass(frozen=True)
class Fading:
    """A regression of the torque residual with friction that falls over a speed.

    Attributes
    ----------
    speed, shape : float
        [rad/s], 1
    torque : float
        What friction has more at rest than at high speed. [N m]
    beside : array
        Coefficients of the columns beside it.
    left : float
        Sum of squares that are left, over the noise's variance.
    """

    speed: float
    shape: float
    torque: float
    beside: Array
    left: float


def fadings(weak: Weak, beside: Sequence[Array], speeds: Array) -> list[Fading]:
    """Regressions in which friction falls, beside other columns (n_y,) of the torque residual; the likeliest first."""
    if len(weak.y) < FEWEST:
        return []
    way, y = np.sign(weak.motion.direction), weak.y / weak.sigma
    found = []
    for speed, shape in product(speeds.tolist(), SHAPES):
        column = weak.integrate(way * fade(weak.motion.w, speed, shape))
        A = np.stack([*beside, column], axis=1) / weak.sigma[:, None]
        if np.linalg.cond(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)) > 1.0 / LEAST:
            continue
        solution, *_ = np.linalg.lstsq(A, y, rcond=None)
        if solution[-1] > 0.0:
            left = float(np.sum((y - A @ solution) ** 2))
            found.append(Fading(speed, shape, float(solution[-1]), np.asarray(solution[:-1]), left))
    return sorted(found, key=lambda f: f.left)


def fading_candidate(plant: Measured, s: AxisSizes, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """The likeliest speeds and shapes as starts, each with friction and inertia as they are beside it."""
    if any(name.startswith(f"{NAME}.") for name in point):
        return None
    weak = weak_form(plant, point, blocks)
    names = ["F_d", *(f.name for f in plant.base if f.name in ("J", "M"))]
    columns = [weak.integrate(np.sign(weak.motion.direction)), weak.inertia][: len(names)]
    limits = {f.name: (f.low, f.high) for f in plant.base}
    starts = []
    for f in fadings(weak, columns, SPEEDS * s.speed):
        start = {name: float(np.clip(point[name] + x, *limits[name])) for name, x in zip(names, f.beside, strict=True)}
        if start["F_d"] > 0.0:
            excess = min(f.torque / start["F_d"], HIGHEST)
            starts.append({**start, f"{NAME}.excess": excess, f"{NAME}.speed": f.speed, f"{NAME}.shape": f.shape})
    starts = starts[:N_STARTS] or [{f"{NAME}.excess": 0.3, f"{NAME}.speed": 0.1 * s.speed, f"{NAME}.shape": 0.0}]
    units = {p.name: p.unit for p in registry()[NAME].parameters}
    bounds = {
        "excess": (0.0, HIGHEST, 0.1),
        "speed": (0.01 * s.speed, s.speed, 0.05 * s.speed),
        "shape": (-1.0, 1.2, 0.2),
    }
    free = tuple(
        Free(f"{NAME}.{name}", units[name], low, high, starts[0][f"{NAME}.{name}"], scale, is_shape=name == "shape")
        for name, (low, high, scale) in bounds.items()
    )
    return Candidate(NAME, NAME, free, tuple(starts))
