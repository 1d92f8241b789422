"""Directions of faults and effects together that a record hardly feels, as a weaker magnet less three shorts.

The Jacobian's columns are differences of simulated means over steps of a few hundredths. Where long columns nearly
cancel, their difference is noise and curvature: even the direction in which they cancel is not known. So the flat
directions are simulated themselves, to both sides, as far as that is clearly felt; the Jacobian learns what that shows
[Broyden, Math. Comp. 19, 1965] and so which directions are flat; and so on from where a step leads. All is simulated
twice with other seeds: the product of two halves has no share of noise, and columns that were learned are no longer
than that says. The scatter of the last turns is part of the deviations. The fit keeps what was learned: who weighs it
by its columns knows as much of flat directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.plant import Point

from .fit import Columns, Fit, bounds, conclude, residuals_at, solve_within_bounds, stacked_jacobian, step_to
from .fit import fit as go_on
from .free import Free, goes_with_temperature

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.plant import EmaPlant

FLAT = 0.3  # length of a direction over that of the longest, below which it is simulated itself
N_SEEDS = 8  # of each half, where all directions are simulated; later half as many runs for those that are flat
N_GLANCE, N_CAREFUL = 4, 16  # where other minima are looked for, and where a step is judged
SEEDS = 4_000_000, 5_000_000
FELT = 60.0  # by how much the whitened features are to differ at either end of a direction
N_STEPS = 2.0  # of finite differences, that no parameter is moved beyond
N_TURNS = 8  # at most
ARRIVED = 3.0  # deviations that a turn may still go along flat directions
REACH, STRIDE = 120.0, 6.0  # whitened: how far along a flat direction other minima are looked for, in what strides
CLEARLY = 4.0  # deviations of what seeds make of a difference, by which less or more is left
SHARES = 1.0, 0.5, 0.25  # of a step that are tried
N_LAST = 3  # turns there whose mean is taken
HARDLY = 0.2  # of FELT, by which a bound may bend a way
# Of the noise of a cycle: by how much honest simulations of the same laws and step differ along a flat direction. The
# likeliest for 115 deviations (`benchmarks.deviations`, other hands): 0.005 to 0.03 within two nats, 0.12 57 behind.
UNSEEN = 0.02
ONE_SIDED = 0.15  # share of a way inside bounds, below which the point itself is the end


@dataclass(frozen=True)
class Probed:
    """The Jacobian by each half of the seeds, (n_features, n_free), in units of the scaled parameters.

    `of_noise`, (n_free, n_free), is what noise makes of the information about a direction: as a quadratic form.
    """

    halves: tuple[Array, Array]
    of_noise: Array

    @property
    def J(self) -> Array:
        """By all seeds."""
        return 0.5 * (self.halves[0] + self.halves[1])


@dataclass(frozen=True)
class System:
    """Equations A x = known of a step x (scaled), of which the last `n_flat` are of flat directions.

    `J`, (n_features, n_free), is the Jacobian; `rows`, (n_free, n_features), make `known` of whitened features.
    """

    J: Array
    A: Array
    known: Array
    rows: Array
    n_flat: int


def settle(plant: EmaPlant, noise: Noise, fit: Fit, cycles: Sequence[int]) -> Fit:
    """`fit` brought to its minimum along flat directions too, with deviations that hold there; itself without any."""
    J = stacked_jacobian(noise, fit.free, fit.columns, cycles)
    scale = np.linalg.norm(J, axis=0)
    if not scale.all() or not len(_flat(J := J / scale, FLAT)[0]):
        return fit
    point: Point = fit.point
    last: list[Point] = []
    for turn in range(N_TURNS):
        reaches, directions = _flat(J, FLAT if turn else np.inf)  # first all: no difference is above suspicion
        ends = [
            [_step_towards(fit.free, point, sign * reach * v, scale) for sign in (1.0, -1.0)]
            for reach, v in zip(reaches, directions, strict=True)
        ]
        ends = [pair for pair in ends if pair[0] != pair[1]]
        if not ends:
            if turn == 0:
                return fit
            break
        ways = scale * np.array([_difference(fit.free, *pair) for pair in ends])
        n_seeds = max(N_SEEDS, N_SEEDS * len(scale) // (2 * len(ends)))
        here, *there = _halves(plant, noise, [point, *(p for pair in ends for p in pair)], cycles, n_seeds)
        probed = _learn(J, ways, np.array(there[1::2]) - np.array(there[::2]), n_seeds)
        of = _system(probed, here)
        J = of.J
        step, _ = solve_within_bounds(of.A * scale, of.known, *bounds(fit.free, point))
        nearer = _go_downhill(plant, noise, fit.free, point, step, cycles)
        point = nearer or point
        if nearer is None or (np.abs(of.A @ (scale * step))[len(step) - of.n_flat :] < ARRIVED).all():
            last.append(point)
        lower = None if turn else _find_lower(plant, noise, fit.free, point, J, scale, cycles)
        if lower is not None:
            point = go_on(plant, noise, fit.free, lower, cycles).point
            last.clear()
        if len(last) == N_LAST or (nearer is None and lower is None):
            break
    last = last or [point]
    point = {name: float(np.mean([p[name] for p in last])) for name in point}
    left = {c: x.mean(axis=0) for c, x in _by_cycle(plant, noise, [point], cycles, N_SEEDS)[0].items()}
    solution = np.linalg.solve(of.A * scale, of.rows)
    parts = np.split(solution, np.cumsum([len(left[c]) for c in cycles])[:-1], axis=1)
    learned = fit.columns | _as_columns(noise, fit.free, J * scale, cycles)
    found = conclude(plant, noise, fit.free, point, learned, left, parts, 0.5 / N_SEEDS)
    wandered = np.array([np.std([p[f.name] for p in last]) for f in fit.free])
    more = np.hypot(wandered, _estimate_unseen(noise, of.A * scale, of.n_flat, cycles))
    return replace(found, sd={name: float(np.hypot(x, y)) for (name, x), y in zip(found.sd.items(), more, strict=True)})


def _go_downhill(
    plant: EmaPlant, noise: Noise, frees: Sequence[Free], point: Point, step: Array, cycles: Sequence[int]
) -> Point | None:
    """The point as far along a step as does not leave clearly more, if there is one: responses bend."""
    points = [point, *(step_to(point, frees, share * step) for share in SHARES)]
    here, *there = _squares(_residuals(plant, noise, points, cycles, N_CAREFUL))
    near = (p for p, left in zip(points[1:], there, strict=True) if left < here + _clearly(here, N_CAREFUL))
    return next(near, None)


def _find_lower(
    plant: EmaPlant, noise: Noise, frees: Sequence[Free], point: Point, J: Array, scale: Array, cycles: Sequence[int]
) -> Point | None:
    """The point along flat directions where least is left once steep ones are fitted, if that is clearly less.

    What pattern the currents run through changes with every parameter: what is left has minima all along, and the
    truth's is no wider than that of the others.
    """
    U, length, V = np.linalg.svd(J, full_matrices=False)
    is_flat = length < FLAT * length[0]
    steep = U[:, ~is_flat]
    ends = np.arange(STRIDE, REACH + STRIDE, STRIDE)
    points = [point]
    for reach, v in zip(1.0 / length[is_flat], V[is_flat], strict=True):
        low, high = (edge * scale for edge in bounds(frees, point))
        ways = reach * np.outer(np.concatenate([-ends, ends]), v)
        over = np.maximum(low - ways, ways - high).max(axis=1)
        points += [step_to(point, frees, np.clip(way, low, high) / scale) for way in ways[over < HARDLY * FELT]]
    left = _residuals(plant, noise, points, cycles, N_GLANCE)
    squares = _squares([r - steep @ (steep.T @ r) for r in left])
    return points[int(np.argmin(squares))] if min(squares) < squares[0] - _clearly(squares[0], N_GLANCE) else None


def _residuals(
    plant: EmaPlant, noise: Noise, points: Sequence[Point], cycles: Sequence[int], n_seeds: int
) -> list[Array]:
    return [np.concatenate([x[c] for c in cycles]) for x in residuals_at(plant, noise, points, cycles, n_seeds)]


def _squares(residuals: Sequence[Array]) -> list[float]:
    return [float(r @ r) for r in residuals]


def _clearly(square: float, n_seeds: int) -> float:
    """Difference of squared residuals that seeds do not make: of means of so many, each as noisy as the record."""
    return CLEARLY * 2.0 * float(np.sqrt(2.0 * square / n_seeds))


def _estimate_unseen(noise: Noise, A: Array, n_flat: int, cycles: Sequence[int]) -> Array:
    """What a difference between honest simulations makes of each parameter, along flat directions (the last of A)."""
    along = np.linalg.inv(A)[:, len(A) - n_flat :]
    return np.asarray(UNSEEN * np.sqrt(noise.expected(cycles) * (along**2).sum(axis=1)))


def _flat(J: Array, flat: float) -> tuple[Array, Array]:
    """How far to go for features to differ by FELT, (n_flat,), and the flat directions, (n_flat, n_free)."""
    _, length, V = np.linalg.svd(J, full_matrices=False)
    is_flat = length < flat * length[0]
    return FELT / length[is_flat], V[is_flat]


def _learn(J: Array, ways: Array, found: Array, n_seeds: int) -> Probed:
    """The Jacobian that agrees with what was found.

    Parameters
    ----------
    ways : array, shape (n_flat, n_free)
    found : array, shape (n_flat, 2, n_features)
        What the features differ by from end to end of each way, by half of the seeds.
    """
    length = np.linalg.norm(ways, axis=1)
    back = np.linalg.pinv(ways / length[:, None], rcond=0.1) / length
    first, second = (J + (back @ (found[:, half] - ways @ J.T)).T for half in (0, 1))
    return Probed((first, second), float(np.sqrt(len(J))) * 2.0 / n_seeds * back @ back.T)


def _as_columns(noise: Noise, frees: Sequence[Free], J: Array, cycles: Sequence[int]) -> Columns:
    """Columns of each motion by what its cycles have on average; but of what goes with each cycle's temperature."""
    ends = np.cumsum([len(noise.of(c).sd) for c in cycles])  # motions may differ in how many features they have
    of_cycle = dict(zip(cycles, np.split(J, ends[:-1]), strict=True))
    found: Columns = {}
    for motion in sorted({int(noise.plant.data.motion[c]) for c in cycles}):
        mean = np.mean([of_cycle[c] for c in cycles if noise.plant.data.motion[c] == motion], axis=0)
        rows = noise.motions[motion].unwhite(mean.T)
        found |= {
            (motion, f.name): row for f, row in zip(frees, rows, strict=True) if not goes_with_temperature(f.name)
        }
    return found


def _system(probed: Probed, r: Array) -> System:
    """Of whitened residuals r, (2, n_features): by the mean of the halves for steep directions, their product for flat.

    Flat columns of the mean are as long as response and noise together: by the share of noise they are taken shorter,
    else they promise what is not there [regression dilution: Fuller, Measurement Error Models, 1987].
    """
    J = probed.J
    U, length, V = np.linalg.svd(J, full_matrices=False)
    n = int(np.sum(length >= FLAT * length[0]))
    U = U[:, :n]
    first, second = (C - U @ (U.T @ C) for C in (half @ V[n:].T for half in probed.halves))
    F = first.T @ second
    information, Q = np.linalg.eigh(0.5 * (F + F.T))
    of_noise = np.einsum("ij,jk,ik->i", Q.T @ V[n:], probed.of_noise, Q.T @ V[n:])
    root = np.sqrt(np.maximum(information, of_noise))[:, None]
    g = 0.5 * (first.T @ r[1] + second.T @ r[0])
    A = np.concatenate([length[:n, None] * V[:n], root * (Q.T @ V[n:])])
    known = np.concatenate([U.T @ r.mean(axis=0), (Q.T @ g) / root[:, 0]])
    flat = 0.5 * (first + second)
    rows = np.concatenate([U.T, Q.T @ flat.T / root])
    shorter = (Q * root.T**2) @ Q.T / length[n:, None] ** 2
    return System(J + flat @ (shorter - np.eye(len(Q))) @ V[n:], A, known, rows, len(Q))


def _by_cycle(
    plant: EmaPlant, noise: Noise, points: Sequence[Point], cycles: Sequence[int], n_seeds: int
) -> list[dict[int, Array]]:
    """Whitened residuals at several points by cycle, twice: shape (2, n_features)."""
    first, second = (residuals_at(plant, noise, points, cycles, n_seeds, seed) for seed in SEEDS)
    return [{c: np.array([a[c], b[c]]) for c in cycles} for a, b in zip(first, second, strict=True)]


def _halves(plant: EmaPlant, noise: Noise, points: Sequence[Point], cycles: Sequence[int], n_seeds: int) -> list[Array]:
    """Whitened residuals at several points, all cycles one behind the other, twice: shape (2, n_features of all)."""
    found = _by_cycle(plant, noise, points, cycles, n_seeds)
    return [np.concatenate([at[c] for c in cycles], axis=1) for at in found]


def _difference(frees: Sequence[Free], high: Point, low: Point) -> Array:
    return np.array([high.get(f.name, 0.0) - low.get(f.name, 0.0) for f in frees])


def _step_towards(frees: Sequence[Free], point: Point, way: Array, scale: Array) -> Point:
    """The point as far along a way (scaled) as bounds allow, but for what is hardly felt when cut off."""
    low, high = (edge * scale for edge in bounds(frees, point))
    share = min(1.0, N_STEPS * float(np.min([abs(f.step) for f in frees] * scale / np.abs(way))))
    over = np.abs(way) > 0.0
    room = (np.where(way > 0.0, high, -low) + HARDLY * FELT)[over] / np.abs(way)[over]
    share = min(share, float(room.min()))
    if share < ONE_SIDED:
        return point
    ends = zip(frees, share * way / scale, strict=True)
    return {**point, **{f.name: float(np.clip(point.get(f.name, 0.0) + d, f.low, f.high)) for f, d in ends}}
