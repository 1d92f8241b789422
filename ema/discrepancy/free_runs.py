"""Whether free runs bear an effect out, which was fitted to the whitened residual.

Both see the same samples, and each sees something else in them: whitened, what is new at each sample; in free runs,
what adds up. An effect that stands for something else may make noise likelier and take nothing from a simulation.
"""

from __future__ import annotations

import numpy as np

from ema.core.records import Array

from .parts import list_parts
from .plant import Plant
from .selection import Tried, list_folds

FALLIBLE = 0.01  # of what the whitened residual is sure of, as much is wrong (frozen trials, P of 0.95 and more)


def trust_by_free_runs(plant: Plant, before: Tried, model: Tried, trust: float) -> float:
    """The trust in an effect, which `model` has and `before` has not, when free runs have been heard too.

    A cause that moves free runs by d takes d² from the squares of their error: what else is left has nothing to do with
    it. What stands for something else takes nothing, or adds up to d². Both are held against what was taken on held-out
    parts, by how these scatter. An effect that hardly moves free runs stays as it was, and they make none surer.
    """
    odds = min(1.0, float(np.exp(_log_ratio(*_by_part(plant, before, model)))))
    sure = min(trust, 1.0 - FALLIBLE)
    return trust * odds / (sure * odds + 1.0 - sure)


def _by_part(plant: Plant, before: Tried, model: Tried) -> tuple[Array, Array]:
    """By how much the square of each part's error falls, and the square by which its runs differ."""
    one, other = _run(plant, before), _run(plant, model)
    parts = [[(one[j], other[j]) for j in sorted(blocks)] for _, _, blocks in list_parts(plant)]
    taken = [sum(float(np.sum(a**2) - np.sum(b**2)) for a, b in part) for part in parts]
    moved = [sum(float(np.sum((a - b) ** 2)) for a, b in part) for part in parts]
    return np.array(taken), np.array(moved)


def _log_ratio(taken: Array, moved: Array) -> float:
    """Log-likelihood that as much was taken as was moved, less that of nothing or of a loss (Student's t).   [nats]"""
    n = len(taken)
    scatter = float(np.std(taken - moved, ddof=1)) * n**0.5 if n > 1 else 0.0
    if scatter == 0.0:
        return 0.0
    claimed, found = moved.sum(), taken.sum()
    deviations = (found - np.array([claimed, np.clip(found, -claimed, 0.0)])) / scatter
    there, not_there = -0.5 * n * np.log1p(deviations**2 / (n - 1))
    return float(there - not_there)


def _run(plant: Plant, model: Tried) -> dict[int, Array]:
    """Errors of free runs by block, each by the fit that had not seen it."""
    out: dict[int, Array] = {}
    for (_, left_out), fitted in zip(list_folds(plant), model.fits, strict=True):
        out.update(zip(left_out, plant.free_run_errors(fitted.point, left_out), strict=True))
    return out
