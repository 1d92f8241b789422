"""Directions of faults and effects together that a record hardly feels, as a weaker magnet less three shorts.

The Jacobian's columns are differences of simulated means over steps of a few hundredths. Where long columns nearly
cancel, their difference is noise and curvature. What is left of the direction itself is stick, slip and switching that
shift in time: felt over short steps, and on the side where the truth lies. So such a direction is simulated itself, to
both sides, over shorter and shorter steps, and twice with other seeds: the product of two halves has no share of noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .features import Array
from .fit import Fit, bounded, bounds, concluded, moved, residuals, stacked_jacobian
from .noise import Noise
from .plant import EmaPlant, Point

FLAT = 0.2  # length of a direction over that of the longest, below which it is simulated itself
N_SEEDS = 12  # of each half
SEEDS = 4_000_000, 5_000_000
REACHES = (1.0, 0.3, 0.1)  # steps of the finite differences, to each side
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
    point: Point = fit.point
    solution = np.empty((0, 0))
    for reach in REACHES:
        here = _halves(plant, noise, point, cycles)
        system, known, rows = [steep], [U.T @ here.mean(axis=0)], [U.T]
        is_clear = True
        for v in flat:
            low, high = (_towards(fit, point, sign * reach, v / scale**2) for sign in (-1.0, 1.0))
            way = float(v @ [high[f.name] - low[f.name] for f in fit.free])
            if way <= 0.0:
                return fit
            c = (_halves(plant, noise, low, cycles) - _halves(plant, noise, high, cycles)) / way
            system[0] = system[0] + np.outer(U.T @ c.mean(axis=0), v)
            c -= c @ U @ U.T
            of_noise = float(np.sqrt(c.shape[1])) * 2.0 / N_SEEDS / way**2
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
    left = residuals(plant, noise, point, cycles, N_SEEDS, SEEDS[0])
    parts = np.split(solution, np.cumsum([len(left[c]) for c in cycles])[:-1], axis=1)
    return concluded(plant, noise, fit.free, point, fit.columns, left, parts, 0.5 / N_SEEDS)


def _halves(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int]) -> Array:
    """Whitened residuals of all cycles one behind the other, twice: shape (2, n_features of all)."""
    found = [residuals(plant, noise, point, cycles, N_SEEDS, seed) for seed in SEEDS]
    return np.array([np.concatenate([half[c] for c in cycles]) for half in found])


def _towards(fit: Fit, point: Point, reach: float, along: Array) -> Point:
    """The point as many steps of finite differences along a direction, inside bounds."""
    amount = reach * float(np.min([abs(f.step) for f in fit.free] / np.abs(along)))
    return moved(point, fit.free, np.clip(amount * along, *bounds(fit.free, point)))
