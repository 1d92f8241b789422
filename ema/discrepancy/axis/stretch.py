"""A stretch of the travel with other friction: the torque residual says where it lies, a fit would not find it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry

from .weak_form import FEWEST, weak_form

if TYPE_CHECKING:
    from ema.effects.search import AxisSizes

    from .measured import Measured

NAME = "position_friction"
WIDTHS = np.geomspace(0.01, 0.6, 8)  # of half the travel
SPACING = 0.7  # of centres, in widths
LEAST = 1e-3  # of a column that must be left beside friction, drag and inertia


def stretch_candidate(plant: Measured, s: AxisSizes, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """For each width the likeliest place as a start; None where the effect is in the model already."""
    if any(name.startswith(NAME) for name in point):
        return None
    weak = weak_form(plant, point, blocks)
    if len(weak.y) < FEWEST:
        return None
    q, rest = weak.beside()
    theta, way = weak.motion.theta, np.sign(weak.motion.direction)
    low, high = float(theta.min()), float(theta.max())
    h = max(s.half_range, 1e-12)
    F_d = max(float(point["F_d"]), 1e-3 * s.torque)
    starts = []
    for w in WIDTHS * h:
        centres = np.arange(low, high + SPACING * w, SPACING * w)
        bumps = way[:, None] * np.exp(-(((theta[:, None] - centres) / w) ** 2))
        columns = weak.integrate(bumps) / weak.sigma[:, None]
        left = columns - q @ (q.T @ columns)
        power: Array = (left**2).sum(axis=0)
        shown = left.T @ rest
        gain = np.where(power > LEAST**2 * (columns**2).sum(axis=0), shown**2 / np.maximum(power, 1e-300), 0.0)
        best = int(np.argmax(gain))
        if gain[best] > 0.0:
            height = float(np.clip(shown[best] / power[best] / F_d, -0.9, 9.0))
            values = {"height": height, "centre": float(centres[best]), "width": float(w)}
            starts.append((float(gain[best]), {f"{NAME}.{key}": value for key, value in values.items()}))
    if not starts:
        return None
    starts.sort(key=lambda start: -start[0])
    first = starts[0][1]
    w = first[f"{NAME}.width"]
    units = {p.name: p.unit for p in registry()[NAME].parameters}
    free = (
        Free(f"{NAME}.height", units["height"], -0.95, 10.0, first[f"{NAME}.height"], 0.1),
        Free(f"{NAME}.centre", units["centre"], low, high, first[f"{NAME}.centre"], 0.2 * w),
        Free(f"{NAME}.width", units["width"], 0.3 * float(WIDTHS[0]) * h, h, w, 0.2 * w),
    )
    return Candidate(NAME, NAME, free, tuple(start for _, start in starts))
