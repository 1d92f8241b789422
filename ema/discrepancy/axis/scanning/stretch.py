"""A stretch of the travel with other friction: the torque residual says where it lies, a fit would not find it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ema.core.records import Array
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry
from ema.effects.position_friction import FORMS, fading

from .weak_form import FEWEST, Weak, bound_friction, fit_frictions, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured
    from ema.effects.search import AxisSizes

NAME = "position_friction"
WIDTHS = np.geomspace(0.01, 0.6, 8)  # of half the travel
RATIO = float(WIDTHS[1] / WIDTHS[0])
N_FINER = 4  # times that the steps between those are halved
LOWEST, HIGHEST = -0.95, 10.0  # of a stretch's friction, over that elsewhere
SPACING = 0.7  # of centres, in widths
LEAST = 1e-3  # of a column that must be left beside friction, drag and inertia


class _Stretch(NamedTuple):
    centre: float
    width: float
    flatness: float

    def near(self, share: float) -> list[_Stretch]:
        """Those that lie this share of half a step to both sides, or are as much narrower or wider."""
        step = 0.5 * share
        moved = [self._replace(centre=self.centre + side * step * SPACING * self.width) for side in (-1.0, 1.0)]
        return [*moved, *(self._replace(width=self.width * RATIO**grown) for grown in (-step, step))]


def _best(every: Sequence[_Stretch], weak: Weak, q: Array, rest: Array) -> _Stretch:
    return every[int(np.argmax(_gains(every, weak, q, rest)))]


def _columns(every: Sequence[_Stretch], weak: Weak) -> Array:
    """Of each stretch what a friction of one does there, over the noise, shape (n_y, n_stretches)."""
    theta, way = weak.motion.theta, np.sign(weak.motion.direction)
    centre, width, flatness = np.array(every).T
    bumps = way[:, None] * np.exp(-fading((theta[:, None] - centre) / width, flatness))
    return np.asarray(weak.integrate(bumps) / weak.sigma[:, None])


def _gains(every: Sequence[_Stretch], weak: Weak, q: Array, rest: Array) -> Array:
    """Power of the residual that each stretch explains beside `q`."""
    columns = _columns(every, weak)
    left = columns - q @ (q.T @ columns)
    power = (left**2).sum(axis=0)
    is_seen = power > LEAST**2 * (columns**2).sum(axis=0)
    return np.where(is_seen, (left.T @ rest) ** 2 / np.maximum(power, 1e-300), 0.0)


def stretch_candidate(plant: Measured, s: AxisSizes, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """For each width and form the likeliest place as a start; None where the effect is in the model already."""
    if any(name.startswith(NAME) for name in point):
        return None
    weak = weak_form(plant, point, blocks)
    if len(weak.y) < FEWEST:
        return None
    q, rest = weak.beside()
    always = np.stack(weak.always(), axis=1)
    low, high = float(weak.motion.theta.min()), float(weak.motion.theta.max())
    h = max(s.half_range, 1e-12)
    starts = []
    for w, flatness in product(WIDTHS * h, FORMS):
        centres = np.arange(low, high + SPACING * w, SPACING * w)
        best = _best([_Stretch(float(c), float(w), flatness) for c in centres], weak, q, rest)
        for k in range(N_FINER):
            best = _best([best, *best.near(0.5**k)], weak, q, rest)
        gain = float(_gains([best], weak, q, rest)[0])
        if gain > 0.0:
            elsewhere, (size,) = fit_frictions(weak, always, _columns([best], weak))
            F_d = bound_friction(plant, s, point, elsewhere)
            height = float(np.clip(size / F_d, LOWEST, HIGHEST))
            values = {"height": height, "centre": best.centre, "width": best.width, "flatness": flatness}
            starts.append((gain, {"F_d": F_d, **{f"{NAME}.{key}": value for key, value in values.items()}}))
    if not starts:
        return None
    starts.sort(key=lambda start: -start[0])
    first = starts[0][1]
    w = first[f"{NAME}.width"]
    units = {p.name: p.unit for p in registry()[NAME].parameters}
    free = (
        Free(f"{NAME}.height", units["height"], LOWEST, HIGHEST, first[f"{NAME}.height"], 0.1),
        Free(f"{NAME}.centre", units["centre"], low, high, first[f"{NAME}.centre"], 0.2 * w),
        Free(f"{NAME}.width", units["width"], 0.3 * float(WIDTHS[0]) * h, h, w, 0.2 * w),
        Free(f"{NAME}.flatness", units["flatness"], 0.0, 1.0, first[f"{NAME}.flatness"], 0.2, is_shape=True),
    )
    return Candidate(NAME, NAME, free, tuple(start for _, start in starts))
