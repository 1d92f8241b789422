"""One effect for any share of what several faults have in common.

A weaker magnet and shorts of all phases are nearly the same torque at the same current. From all of it by faults to all
by the effect leads a ridge, along which the record changes by little and not evenly: either end may be a minimum of its
own, which no step by slopes leaves. So the ridge is walked, and a fit begins where it is lowest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.actuator.fitting.candidates import Candidate
from ema.discrepancy.actuator.fitting.fit import fit
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.model import FAR, Model
from ema.discrepancy.plant import Point

from .screening import COLLINEAR, Screened, start_with

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

N_SHARES = 8  # of the ridge


def walk_ridge(search: Search, model: Model, made: Model, effect: Candidate, to_beat: float) -> Model:
    """`made`, which is `model` with an effect that several of its faults can stand for, or one that leaves less.

    The other one is fitted from the lowest point of the ridge, if that is lower than where `made` ended.
    """
    points = _ridge(search, model, effect)
    costs = search.costs([made.fit.point, *points], search.train, typical=False)
    lowest = int(np.argmin(costs))
    if lowest == 0:
        return made
    other = search.model(made.effects, made.fit.free, points[lowest - 1], None, 3, to_beat)
    return min(made, other, key=lambda m: m.heldout)


def _ridge(search: Search, model: Model, effect: Candidate) -> list[Point]:
    """Points at equal distances, from an eighth of the faults' common part by the effect to all of it.

    The effect is fitted at the middle and at the end, with the other faults: shorts of all phases do what inertia does
    with friction. Between them these go along a parabola.
    """
    k = model.fit.point
    common = min(k[name] for name in effect.faults)
    frees = (*(f for f in K_FREE if f.name not in effect.faults), *effect.frees)
    begin = {f.name: k.get(f.name, search.plant.neutral(f.name)) for f in frees}

    def faults(share: float) -> Point:
        return {name: k[name] - share * common for name in effect.faults}

    middle, end = (
        fit(search.plant, search.noise, frees, start_with(search, model, effect, faults(s)), search.train).point
        for s in (0.5, 1.0)
    )

    def at(s: float) -> Point:
        size = {
            name: x + s * (4.0 * middle[name] - 3.0 * x - end[name]) + 2.0 * s**2 * (x + end[name] - 2.0 * middle[name])
            for name, x in begin.items()
        }
        size = {f.name: float(np.clip(size[f.name], f.low, f.high)) for f in frees}
        return {**end, **faults(s), **size}

    return [at((1.0 + j) / N_SHARES) for j in range(N_SHARES)]


def sort_by_nearness(search: Search, model: Model, screened: Sequence[Screened]) -> list[Screened]:
    """Those that can stand for what several faults have in common, the one first that leaves least of that.

    Simulated with the common part gone, and the effect as large as first order says: near the data an effect must do
    as much of it as what looks alike does.
    """
    if not screened:
        return []
    less = [subtract_common(model, s.candidate) for s in screened]
    ends = [start_with(search, model, s.candidate, rest) for s, rest in zip(screened, less, strict=True)]
    points = [model.fit.point, *ends, *({**model.fit.point, **rest} for rest in less)]
    far = model.excess > FAR
    here, *there = search.costs(points, search.train, typical=far)
    pairs = zip(there[: len(ends)], there[len(ends) :], strict=True)
    left = [(end - here) / max(gone - here, 1e-9) for end, gone in pairs]
    ranked = sorted(zip(left, screened, strict=True), key=lambda entry: entry[0])
    return [s for share, s in ranked if far or share < 1.0 - COLLINEAR**2]


def subtract_common(model: Model, effect: Candidate) -> Point:
    """The faults that an effect can be mistaken for, less what they have in common."""
    k = model.fit.point
    common = min(k[name] for name in effect.faults)
    return {name: k[name] - common for name in effect.faults}
