"""Friction that changes once and twice per turn: the torque residual says by how much, a fit from little goes astray.

Where friction holds the axis for a while, a fit that begins with too little of it has other stretches at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects.friction_by_angle import EFFECT, MOST
from ema.effects.per_turn import ORDERS, PARTS, is_shown

from .weak_form import FEWEST, bound_friction, fit_frictions, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured
    from ema.effects.search import AxisSizes

SCALE = 0.03  # of dry friction: a change that matters


def rubbing_candidate(plant: Measured, s: AxisSizes, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """What a regression beside friction, drag and inertia says, as a start; None where it is there or unseen."""
    if not is_shown(s) or any(name.startswith(EFFECT.name) for name in point):
        return None
    weak = weak_form(plant, point, blocks)
    if len(weak.y) < FEWEST:
        return None
    theta, way = weak.motion.theta, np.sign(weak.motion.direction)
    columns = [weak.integrate(way * part(n * theta)) for n in ORDERS for part in (np.cos, np.sin)]
    always = np.stack(weak.always(), axis=1)
    everywhere, own = fit_frictions(weak, always, np.stack(columns, axis=1) / weak.sigma[:, None])
    F_d = bound_friction(plant, s, point, everywhere)
    start = {f"{EFFECT.name}.{part}": float(x) for part, x in zip(PARTS, np.clip(own / F_d, -MOST, MOST), strict=True)}
    units = {p.name: p.unit for p in EFFECT.parameters}
    free = tuple(Free(f"{EFFECT.name}.{p}", units[p], -MOST, MOST, start[f"{EFFECT.name}.{p}"], SCALE) for p in PARTS)
    return Candidate(EFFECT.name, EFFECT.name, free, ({"F_d": F_d, **start},))
