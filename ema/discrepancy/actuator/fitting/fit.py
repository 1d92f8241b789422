"""Fit faults and parameters of effects to measured cycles: Gauss–Newton on simulated means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import lsq_linear

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.simulating.noise import Noise, disagreement, scatter
from ema.discrepancy.plant import Point

from .free import K_STEP, Free, goes_with_temperature
from .valley import hold_product, pairs, slopes, step_by_product

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.plant import EmaPlant, Steps

N_SEEDS = 8  # at least, while searching
N_COLUMN = 12  # seeds of a column of the Jacobian
SEED = 1_000_000
TRUSTED = 0.75  # share of the promised gain, below which columns are taken anew
LENGTH = 150.0  # of a step, in standard deviations of a cycle: four times the noise of one cycle's features
FAR_OFF = 1.5  # misfit above which steps may be longer than first order says
SHORT = 75.0  # of a step near the end, where the curvature of the response counts for more than noise


Columns = dict[tuple[int, str], Array]  # by motion and name of the parameter; not whitened, per unit


def column_points(point: Point, f: Free, follows: str | None = None) -> tuple[Point, float]:
    """The point one step along a parameter (inside its bounds), or along the valley of a pair, and the step."""
    x = point.get(f.name, 0.0)
    step = f.step if f.low <= x + f.step <= f.high else -f.step
    moved = {**point, f.name: x + step}
    return moved if follows is None else hold_product(point, moved, f.name, follows), step


def columns(plant: EmaPlant, frees: Sequence[Free], point: Point, motions: Sequence[int]) -> Columns:
    """Finite-difference columns of the mean features at a point."""
    if not frees:
        return {}
    names = [f.name for f in frees]
    follows = pairs(names)
    moved = [column_points(point, f, follows.get(f.name)) for f in frees]
    first = [plant.first[motion] for motion in motions]
    here, *means = plant.means([point, *(p for p, _ in moved)], first, N_COLUMN, SEED)
    own = np.linalg.inv(slopes(point, names))
    found: Columns = {}
    for motion, c in zip(motions, first, strict=True):
        along = np.array([(mean[c] - here[c]) / step for mean, (_, step) in zip(means, moved, strict=True)])
        found |= {(motion, f.name): column for f, column in zip(frees, own.T @ along, strict=True)}
    return found


def columns_of_all(plant: EmaPlant, of: Fit) -> Columns:
    """The Jacobian of a fit with that of the motions that it was not fitted to."""
    new = [m for m in range(plant.n_motions) if any((m, f.name) not in of.columns for f in of.free)]
    return of.columns | columns(plant, of.free, of.point, new)


@dataclass(frozen=True)
class Fit:
    """A fitted model on some cycles.

    Attributes
    ----------
    point : Point
    free : tuple of Free
    columns : Columns
        Jacobian of the last iteration.
    residuals : dict of arrays
        Whitened residual by cycle, of the cycles it was fitted on.
    misfit : float
        Sum of squares over what noise makes of it.
    sd : dict
        Standard deviation of each free parameter: the larger of what noise and what the disagreement of motions makes.
    given_up : bool
        The fit was not gone on with, since its next step promised to leave more than `to_beat`.
    """

    point: Point
    free: tuple[Free, ...]
    columns: Columns
    residuals: dict[int, Array]
    misfit: float
    sd: dict[str, float]
    given_up: bool = False

    @property
    def cost(self) -> float:
        """Sum of squares that it leaves of the cycles it was fitted on."""
        return sum(float(r @ r) for r in self.residuals.values())


def residuals_at(
    plant: EmaPlant,
    noise: Noise,
    points: Sequence[Point],
    cycles: Sequence[int],
    n_seeds: int,
    seed: int = SEED,
    steps: Steps = None,
) -> list[dict[int, Array]]:
    """Whitened measured less mean simulated features at several points, by cycle."""
    means = plant.means(points, cycles, n_seeds, seed, steps)
    return [{c: noise.of(c).white(plant.data.y[c] - at[c]) for c in cycles} for at in means]


def residuals(
    plant: EmaPlant,
    noise: Noise,
    point: Point,
    cycles: Sequence[int],
    n_seeds: int,
    seed: int = SEED,
    steps: Steps = None,
) -> dict[int, Array]:
    """Whitened measured less mean simulated features at one point, by cycle."""
    return residuals_at(plant, noise, [point], cycles, n_seeds, seed, steps)[0]


def misfit_at(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int], steps: Steps = None) -> float:
    """What a point leaves of cycles, over what noise makes of them."""
    left = residuals(plant, noise, point, cycles, plant.n_seeds(cycles, N_SEEDS), SEED, steps)
    return noise.misfit(list(left.values()), cycles)


def excess_at(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int], steps: Steps = None) -> float:
    """What a point leaves of cycles beyond noise, as a misfit."""
    return max(misfit_at(plant, noise, point, cycles, steps) - 1.0, 0.0)


def stacked_jacobian(noise: Noise, frees: Sequence[Free], cols: Columns, cycles: Sequence[int]) -> Array:
    """Whitened Jacobian of all cycles below each other, (n_cycles * n_features, n_free).

    Columns are those of each motion's reference cycle; what acts per kelvin does so in proportion.
    """
    data, first = noise.plant.data, noise.plant.first
    by_motion = {
        m: noise.motions[m].white(np.array([cols[m, f.name] for f in frees])).T
        for m in sorted({int(data.motion[c]) for c in cycles})
    }
    per_kelvin = np.array([goes_with_temperature(f.name) for f in frees])

    def at(cycle: int) -> Array:
        motion = int(data.motion[cycle])
        dT, dT_column = data.dT[cycle], data.dT[first[motion]]
        return by_motion[motion] * np.where(per_kelvin, dT / dT_column if dT_column else 0.0, 1.0)

    return np.concatenate([at(c) for c in cycles])


def solve_within_bounds(J: Array, r: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Least-squares solution within bounds, and the squared residual it promises."""
    scale = _lengths(J)
    margin = 1e-12 * (1.0 + high - low)
    solved = lsq_linear(J / scale, r, ((low - margin) * scale, (high + margin) * scale), method="bvls")
    return np.clip(solved.x / scale, low, high), 2.0 * float(solved.cost)


def bounds(frees: Sequence[Free], point: Point) -> tuple[Array, Array]:
    """How far each parameter may go down and up from a point."""
    x = np.array([point.get(f.name, 0.0) for f in frees])
    return np.array([f.low for f in frees]) - x, np.array([f.high for f in frees]) - x


def step_to(point: Point, frees: Sequence[Free], step: Array) -> Point:
    """The point after a step."""
    moved = {**point, **{f.name: point.get(f.name, 0.0) + float(d) for f, d in zip(frees, step, strict=True)}}
    follow = step_by_product(point, moved, [f.name for f in frees])
    return moved | {f.name: float(np.clip(follow[f.name], f.low, f.high)) for f in frees if f.name in follow}


def _is_stale(f: Free, frees: Sequence[Free], point: Point, at: Point) -> bool:
    """Whether a column taken at `at` no longer holds: a fault moved, or the parameters of the same effect did."""
    mine = f.name.split(".")[0]
    if f.name in FAULTS:
        return any(abs(point.get(n, 0.0) - at.get(n, 0.0)) > K_STEP for n in FAULTS)
    moved_far = any(abs(point.get(n, 0.0) - at.get(n, 0.0)) > 2.0 * K_STEP for n in FAULTS)
    return moved_far or any(
        abs(point.get(g.name, 0.0) - at.get(g.name, 0.0)) > abs(g.step) for g in frees if g.name.split(".")[0] == mine
    )


def fit(
    plant: EmaPlant,
    noise: Noise,
    frees: Sequence[Free],
    start: Point,
    cycles: Sequence[int],
    *,
    known: Columns | None = None,
    n_iterations: int = 3,
    to_beat: float = np.inf,
) -> Fit:
    """Gauss–Newton from `start`; columns in `known` are used in the first iteration instead of new ones.

    A fit whose next step promises to leave more than the misfit `to_beat`, by the columns it has, is given up there.
    """
    motions = sorted({int(plant.data.motion[c]) for c in cycles})
    n_seeds = plant.n_seeds(cycles, N_SEEDS)
    point: Point = dict(start)
    res = residuals(plant, noise, point, cycles, n_seeds)
    cost = sum(float(r @ r) for r in res.values())
    cols: Columns = dict(known or {})
    J = np.empty((0, 0))
    steps: dict[str, float] = {}
    at: dict[str, Point] = dict.fromkeys((f.name for f in frees if (motions[0], f.name) in cols), point)
    hopeless, given_up = to_beat * noise.expected(cycles), False
    for turn in range(n_iterations):
        if turn and np.isfinite(hopeless):
            r = np.concatenate([res[c] for c in cycles])
            given_up = solve_within_bounds(J, r, *bounds(frees, point))[1] > hopeless
            if given_up:
                break
        stale = [f for f in frees if f.name not in at or _is_stale(f, frees, point, at[f.name])]
        at |= {f.name: point for f in stale}
        stale = [replace(f, step=steps.get(f.name, f.step)) for f in stale]
        cols |= columns(plant, stale, point, motions)
        J = stacked_jacobian(noise, frees, cols, cycles)
        length = _lengths_along_valleys(J, frees, point) / np.sqrt(len(cycles))
        steps = {
            f.name: np.sign(f.step) * min(abs(f.step), LENGTH / max(x, 1e-300))
            for f, x in zip(frees, length, strict=True)
        }
        r = np.concatenate([res[c] for c in cycles])
        step, promised = solve_within_bounds(J, r, *bounds(frees, point))
        if cost - promised < 4.0 * len(frees) and not stale:
            break
        before, before_cost = point, cost
        point, res, cost = _search_along(plant, noise, frees, step, (point, res, cost), cycles, n_seeds)
        improved, gained = cost < before_cost, before_cost - cost
        was_fresh = all(where == before for where in at.values())
        if not improved or gained < TRUSTED * (before_cost - promised):
            at.clear()  # old columns may be to blame
        if (not improved or gained < 0.001 * cost) and was_fresh:
            break
    # Near the optimum what seeds make of the cost hides what a step gains; the step itself is known far better.
    last, _ = solve_within_bounds(J, np.concatenate([res[c] for c in cycles]), *bounds(frees, point))
    if all(abs(d) <= abs(f.step) for d, f in zip(last, frees, strict=True)):
        point = step_to(point, frees, last)
        res = residuals(plant, noise, point, cycles, n_seeds)
    found = [res[c] for c in cycles]
    solution = np.split(_pseudo_inverse(J), np.cumsum([len(r) for r in found])[:-1], axis=1)
    return replace(conclude(plant, noise, frees, point, cols, res, solution, 1.0 / n_seeds), given_up=given_up)


Reached = tuple[Point, dict[int, Array], float]  # a point, its whitened residuals and their sum of squares


def _search_along(
    plant: EmaPlant,
    noise: Noise,
    frees: Sequence[Free],
    step: Array,
    here: Reached,
    cycles: Sequence[int],
    n_seeds: int,
) -> Reached:
    """The point along a step that leaves less than `here`, if there is one; further than the step while that gains.

    Noise in columns that are nearly alike makes the step between them too short.
    """
    low, high = bounds(frees, here[0])

    def reach(share: float) -> Reached:
        point = step_to(here[0], frees, np.clip(share * step, low, high))
        res = residuals(plant, noise, point, cycles, n_seeds)
        return point, res, sum(float(x @ x) for x in res.values())

    for share in (1.0, 0.5, 0.2):
        best = reach(share)
        if best[2] < here[2]:
            break
    else:
        return here
    while share >= 1.0 and noise.misfit(list(best[1].values()), cycles) > FAR_OFF:
        share *= 2.0
        longer = reach(share)
        if longer[2] >= best[2]:
            break
        best = longer
    return best


def refit_with_short_steps(plant: EmaPlant, noise: Noise, found: Fit, cycles: Sequence[int]) -> Fit:
    """The fit gone on with, by differences over shorter steps."""
    J = stacked_jacobian(noise, found.free, found.columns, cycles)
    length = _lengths_along_valleys(J, found.free, found.point) / np.sqrt(len(cycles))
    frees = [
        replace(f, step=float(np.sign(f.step)) * min(abs(f.step), SHORT / max(x, 1e-300)))
        for f, x in zip(found.free, length, strict=True)
    ]
    return fit(plant, noise, frees, found.point, cycles, n_iterations=2)


def conclude(
    plant: EmaPlant,
    noise: Noise,
    frees: Sequence[Free],
    point: Point,
    cols: Columns,
    res: dict[int, Array],
    solution: Sequence[Array],
    extra: float,
) -> Fit:
    """The fit at a point, with what noise and the disagreement of motions make of its parameters.

    Parameters
    ----------
    solution : sequence of arrays, shape (n_free, n_features)
        What each cycle's whitened residual adds to the parameters.
    extra : float
        Variance of the predicted mean over that of one run (1 / number of seeds).
    """
    cycles, found = list(res), list(res.values())
    misfit = noise.misfit(found, cycles)
    random = (1.0 + extra) * max(misfit, 1.0) * scatter(noise, solution, cycles)
    sd = np.sqrt(np.maximum(np.diag(random), np.diag(disagreement(plant.data, solution, found, cycles))))
    return Fit(point, tuple(frees), cols, res, misfit, dict(zip((f.name for f in frees), sd.tolist(), strict=True)))


def _lengths_along_valleys(J: Array, frees: Sequence[Free], point: Point) -> Array:
    """What a step of each parameter makes of the features per unit, as differences are taken."""
    return np.asarray(np.linalg.norm(J @ slopes(point, [f.name for f in frees]), axis=0))


def _lengths(J: Array) -> Array:
    """Lengths of the columns; one where there is nothing."""
    length = np.linalg.norm(J, axis=0)
    return np.where(length == 0.0, 1.0, length)


def _pseudo_inverse(J: Array) -> Array:
    scale = _lengths(J)
    return np.asarray(np.linalg.pinv(J / scale, rcond=1e-10) / scale[:, None])
