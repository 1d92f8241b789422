"""Every cycle held out once: the answer's parameters are fitted to the other cycles, and foretell this one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.actuator.simulating.plant import ENVELOPE_STEP, EmaPlant
from ema.discrepancy.folds import Folds, deal
from ema.discrepancy.plant import Point

from .fit import SEED, bounds, columns_of_all, residuals, solve_within_bounds, stacked_jacobian, step_to
from .model import FINAL_SEED, N_FINAL, N_GLANCE, Model

if TYPE_CHECKING:
    from .search import Search

N_FOLDS = 8  # at most; of more cycles several are left out together
ENVELOPE_SETTLING = 15e-3  # [s]


def settled(plant: EmaPlant) -> int:
    """First sample of the envelope that the low-pass no longer ties to the unknown current at the start."""
    return round(ENVELOPE_SETTLING * plant.plant.control.rate) // ENVELOPE_STEP


@dataclass(frozen=True)
class _Linear:
    """A model to first order about its point: whitened residuals and Jacobian of each cycle, its cost at a glance."""

    model: Model
    r: dict[int, Array]
    J: dict[int, Array]
    cost: dict[int, float]

    @classmethod
    def of(cls, search: Search, model: Model, cycles: list[int]) -> _Linear:
        plant, noise, frees, point = search.plant, search.noise, model.fit.free, model.fit.point
        cols = columns_of_all(plant, model.fit)
        r = residuals(plant, noise, point, cycles, N_FINAL, FINAL_SEED)
        glance = residuals(plant, noise, point, cycles, N_GLANCE)
        cost = {c: float(x @ x) for c, x in glance.items()}
        return cls(model, r, {c: stacked_jacobian(noise, frees, cols, [c]) for c in cycles}, cost)

    def stepped(self, cycles: list[int]) -> Point:
        """Where one step of Gauss–Newton from the point leads that fits it to some cycles."""
        frees, point = self.model.fit.free, self.model.fit.point
        J, r = (np.concatenate([of[c] for c in cycles]) for of in (self.J, self.r))
        step, _ = solve_within_bounds(J, r, *bounds(frees, point))
        return step_to(point, frees, step)


def _fitted(search: Search, of: list[tuple[_Linear, list[int]]]) -> list[Point]:
    """Models fitted to some cycles each; the point itself where simulation says that the step leads away."""
    plant = search.plant
    stepped = [m.stepped(cycles) for m, cycles in of]
    runs = plant.each([(there, cycles) for there, (_, cycles) in zip(stepped, of, strict=True)], N_GLANCE, SEED)
    points = []
    for there, (m, cycles), at in zip(stepped, of, runs, strict=True):
        left = (search.noise.of(c).white(plant.data.y[c] - at[c].features.mean(axis=0)) for c in cycles)
        gone, here = sum(float(x @ x) for x in left), sum(m.cost[c] for c in cycles)
        points.append(there if gone < here else m.model.fit.point)
    return points


def over_folds(search: Search, before: Model, after: Model) -> tuple[Folds, Folds]:
    """What `before` and `after` leave of each cycle when the other cycles alone give their parameters.

    Of the envelope [A²], and of the whitened features [per feature], which see more. Parameters are refitted to first
    order about the answer, which costs two simulations of each cycle and fold instead of a fit. Which effects these are
    was decided with all cycles.
    """
    plant, data, noise = search.plant, search.plant.data, search.noise
    cycles = sorted(range(data.n_cycles), key=lambda c: (int(data.motion[c]), c))
    models = [before] if after is before else [before, after]
    squares: list[dict[int, float]] = [{} for _ in models]
    residual: list[dict[int, float]] = [{} for _ in models]
    parts = deal(cycles, N_FOLDS)
    linear = [_Linear.of(search, m, cycles) for m in models]
    points = _fitted(search, [(m, [c for c in cycles if c not in part]) for m in linear for part in parts])
    turns = [(of, whitened, part) for of, whitened in zip(squares, residual, strict=True) for part in parts]
    runs = plant.each([(point, part) for point, (*_, part) in zip(points, turns, strict=True)], N_FINAL, FINAL_SEED)
    for (of, whitened, part), at in zip(turns, runs, strict=True):
        of |= {c: square(plant, c, at[c].envelopes.mean(axis=0)) for c in part}
        left = {c: noise.of(c).white(data.y[c] - at[c].features.mean(axis=0)) for c in part}
        whitened |= {c: float(np.mean(x**2)) for c, x in left.items()}
    order = sorted(cycles)

    def folds(of: Sequence[dict[int, float]], floor: Callable[[Search, int], float], weight: Sequence[float]) -> Folds:
        b, a = (tuple(each[c] for c in order) for each in (of[0], of[-1]))
        return Folds(data.labels, b, a, tuple(floor(search, c) for c in order), tuple(weight))

    n_features = [float(len(data.y[c])) for c in order]
    return folds(squares, _floor, [1.0] * len(order)), folds(residual, _whitened_floor, n_features)


def square(plant: EmaPlant, cycle: int, simulated: Array) -> float:
    """Mean square of measured less simulated envelope. [A²]"""
    error = plant.data.envelopes[cycle][::ENVELOPE_STEP] - simulated
    return float(np.mean(error[settled(plant) :] ** 2))


def _floor(search: Search, cycle: int) -> float:
    """What noise makes of a cycle and of the mean of the runs it is compared with. [A²]"""
    sd = search.noise.of(cycle).envelope_sd[settled(search.plant) :]
    return float(np.mean(sd**2)) * (1.0 + 1.0 / N_FINAL)


def _whitened_floor(search: Search, cycle: int) -> float:
    """What noise makes of a whitened feature of a cycle, by runs that the whitening has not seen."""
    return float(np.mean(search.noise.of(cycle).fresh ** 2)) * (1.0 + 1.0 / N_FINAL)
