"""Directions of faults and effects together that a record hardly feels, as a weaker magnet less three shorts.

The Jacobian's columns are differences of simulated means over steps of a few hundredths. Where long columns nearly
cancel, their difference is noise and curvature. What is left of the direction itself is stick, slip and switching that
shift in time: felt over short steps, and on the side where the truth lies. So such a direction is simulated itself, to
both sides, over shorter and shorter steps, and twice with other seeds: the product of two halves has no share of noise.
Where the last turns wander still, their mean is taken, and their scatter is part of the deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .features import Array
from .fit import Fit, Free, bounded, bounds, concluded, moved, residuals_at, stacked_jacobian
from .noise import Noise
from .plant import EmaPlant, Point

FLAT = 0.2  # length of a direction over that of the longest, below which it is simulated itself
N_SEEDS = 12  # at least, of each half
SEEDS = 4_000_000, 5_000_000
REACHES = (1.0, 0.3, 0.1)  # steps of the finite differences, to each side
N_TURNS = 8  # at most
ARRIVED = 0.5  # share of a reach that a turn may still go, to look closer
CLEAR = 4.0  # times its noise: information of a direction, below which steps are not made shorter


def settled(plant: EmaPlant, noise: Noise, fit: Fit, cycles: Sequence[int]) -> Fit:
    """`fit` brought to its minimum along flat directions too, with deviations that hold there; itself without any."""
    J = stacked_jacobian(noise, fit.free, fit.columns, cycles)
    scale = np.linalg.norm(J, axis=0)
    if not scale.all():
        return fit
    U, length, V = np.linalg.svd(J / scale, full_matrices=False)
    n = int(np.sum(length > FLAT * length[0]))
    if n == len(length):
        return fit
    U, steep, flat = U[:, :n], length[:n, None] * V[:n] * scale, V[n:] * scale
    n_seeds = plant.n_seeds(cycles, N_SEEDS)
    point: Point = fit.point
    solution = np.empty((0, 0))
    reaches = list(REACHES)
    last: list[Point] = []
    for _ in range(N_TURNS):
        ends = [
            (_towards(fit.free, point, -reaches[0], v), _towards(fit.free, point, reaches[0], v))
            for v in flat / scale**2
        ]
        ways = np.array([v @ _difference(fit.free, *pair) for v, pair in zip(flat, ends, strict=True)])
        if not (ways > 0.0).all():
            return fit
        here, *there = _halves(plant, noise, [point, *(p for pair in ends for p in pair)], cycles, n_seeds)
        system, known, rows = [steep], [U.T @ here.mean(axis=0)], [U.T]
        is_clear = True
        for v, way, low, high in zip(flat, ways, there[::2], there[1::2], strict=True):
            c = (low - high) / way
            system[0] = system[0] + np.outer(U.T @ c.mean(axis=0), v)
            c -= c @ U @ U.T
            of_noise = float(np.sqrt(c.shape[1])) * 2.0 / n_seeds / way**2
            information = max(float(c[0] @ c[1]), of_noise)
            is_clear &= information >= CLEAR * of_noise
            system.append(np.sqrt(information) * v[None])
            known.append(np.array([0.5 * (c[0] @ here[1] + c[1] @ here[0]) / np.sqrt(information)]))
            rows.append(c.mean(axis=0, keepdims=True) / np.sqrt(information))
        if solution.size and not is_clear:
            break
        A = np.concatenate(system)
        step, _ = bounded(A, np.concatenate(known), *bounds(fit.free, point))
        point = moved(point, fit.free, step)
        solution = np.linalg.solve(A, np.concatenate(rows))
        last += [point] if len(reaches) == 1 else []
        if (np.abs(flat @ step) < ARRIVED * 0.5 * ways).all():
            del reaches[0]
        if not reaches:
            break
    else:
        point = {name: float(np.mean([p[name] for p in last])) for name in point} if last else point
    left = {c: x.mean(axis=0) for c, x in _by_cycle(plant, noise, [point], cycles, n_seeds)[0].items()}
    parts = np.split(solution, np.cumsum([len(left[c]) for c in cycles])[:-1], axis=1)
    found = concluded(plant, noise, fit.free, point, fit.columns, left, parts, 0.5 / n_seeds)
    sd = {name: float(np.hypot(x, np.std([p[name] for p in last or [point]]))) for name, x in found.sd.items()}
    return replace(found, sd=sd)


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


def _difference(frees: Sequence[Free], low: Point, high: Point) -> Array:
    return np.array([high[f.name] - low[f.name] for f in frees])


def _towards(frees: Sequence[Free], point: Point, reach: float, along: Array) -> Point:
    """The point as many steps of finite differences along a direction, inside bounds."""
    amount = reach * float(np.min([abs(f.step) for f in frees] / np.abs(along)))
    return moved(point, frees, np.clip(amount * along, *bounds(frees, point)))
