"""Whether free runs bear an effect out, which was fitted to the whitened residual.

Both see the same samples, and each sees something else in them: whitened, what is new at each sample; in free runs,
what adds up. An effect that stands for something else may make noise likelier and take nothing from a simulation.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, t

from ema.core.records import Array

from .grade import UPPER
from .held_out import list_parts
from .plant import Plant
from .selection import Tried, list_folds


def most_borne_out(plant: Plant, before: Tried, model: Tried) -> float:
    """Most of the motion by which `model` differs from `before` that their free runs on held-out parts may confirm.

    A cause that moves free runs by d takes d² from the squares of their error: what else is left has nothing to do with
    it. What stands for something else moves them too, and takes less. The share of d² that is taken, at the upper end
    of its interval of 95 % by how parts scatter, from 0 to 1; it is 1 where an effect hardly moves free runs, or where
    there is one part only.
    """
    one, other = _run(plant, before), _run(plant, model)
    parts = [[(one[j], other[j]) for j in sorted(blocks)] for _, _, blocks in list_parts(plant)]
    moved = np.array([sum(float(np.sum((a - b) ** 2)) for a, b in part) for part in parts])
    taken = np.array([sum(float(np.sum(a**2) - np.sum(b**2)) for a, b in part) for part in parts])
    if len(parts) < 2 or not moved.sum() > 0.0:
        return 1.0
    error = float(np.std(taken - moved, ddof=1)) * len(parts) ** 0.5
    deviations = float(t.ppf(norm.cdf(UPPER), len(parts) - 1))  # few parts know their scatter badly
    return float(np.clip((taken.sum() + deviations * error) / moved.sum(), 0.0, 1.0))


def _run(plant: Plant, model: Tried) -> dict[int, Array]:
    """Errors of free runs by block, each by the fit that had not seen it."""
    out: dict[int, Array] = {}
    for (_, left_out), fitted in zip(list_folds(plant), model.fits, strict=True):
        out.update(zip(left_out, plant.free_run_errors(fitted.point, left_out), strict=True))
    return out
