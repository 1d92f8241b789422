"""Free runs as a witness of what the balance of torque adds: do they need a law as much as the balance does?

A law that is there takes from free runs what it takes from the balance. What stands for something else in the balance,
of which the library has no law, acts otherwise over a whole run, or not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.fitting import WILD, best_fit, fit
from ema.discrepancy.plant import Point

from .balance.as_effects import effects, errors
from .balance.found import Balance, Term
from .screened import begin_at

if TYPE_CHECKING:
    from .plant import AxisPlant

N_ITERATIONS = 8  # of a fit that asks how much a law could take


def excess(residuals: Sequence[Array]) -> float:
    """Mean square above that of noise."""
    r = np.concatenate([block.ravel() for block in residuals])
    return max(float(np.mean(np.clip(r, -WILD, WILD) ** 2)) - 1.0, 0.0)


def measure_support(plant: AxisPlant, point: Point, b: Balance, term: Term) -> float:
    """Share of the rest that a law takes in free runs at `point`, over what it takes in the balance; 0 to 1."""
    blocks = list(range(len(plant.blocks)))
    without = fit(plant, plant.base, point, blocks, max_iterations=N_ITERATIONS)
    here = excess(without.residuals)
    taken, unsure = 0.0, errors(b, term)
    for name, values in effects(b, term).items():
        law = begin_at(name, values, unsure.get(name, {}))
        starts = [{**point, **start} for start in law.starts]
        fitted = best_fit(plant, [*plant.base, *law.free], starts, blocks, max_iterations=N_ITERATIONS)
        taken = max(taken, 1.0 - excess(fitted.residuals) / max(here, 1e-300))
    promised = term.power / max(term.power + b.left - b.noise, 1e-300)
    return min(max(taken, 0.0) / promised, 1.0)
