"""Free runs as a witness of what the balance of torque adds: do they need a law as much as the balance does?

A law that is there takes from free runs what it takes from the balance. What stands for something else in the balance,
of which the library has no law, acts otherwise over a whole run, or not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.axis.balance.regressing.found import Balance, Term
from ema.discrepancy.axis.balance.telling.as_effects import effects, errors
from ema.discrepancy.axis.finding.screened import begin_at
from ema.discrepancy.fitting import WILD, fit
from ema.discrepancy.plant import Point

if TYPE_CHECKING:
    from ema.discrepancy.axis.finding.plant import AxisPlant

N_ITERATIONS = 8  # of a fit that asks how much a law could take


def excess(residuals: Sequence[Array]) -> float:
    """Mean square above that of noise."""
    r = np.concatenate([block.ravel() for block in residuals])
    return max(float(np.mean(np.clip(r, -WILD, WILD) ** 2)) - 1.0, 0.0)


def measure_support(plant: AxisPlant, point: Point, b: Balance, terms: Sequence[Term]) -> list[float]:
    """For each law the share of the rest that it takes in free runs, over what it takes in the balance; 0 to 1.

    Both beside the others of `terms`, and with what free runs found at `point` fitted again: it stood for them too.
    """
    blocks = list(range(len(plant.blocks)))
    known = plant.candidates({f.name: f.start for f in plant.base}, blocks)
    found = {f.name: f for f in (*plant.base, *(f for c in known for f in c.free)) if f.name in point}

    def leave(laws: Sequence[Term]) -> float:
        """What is left beside noise."""
        of = [
            begin_at(name, own, errors(b, t).get(name, {}), b.travel)
            for t in laws
            for name, own in effects(b, t).items()
        ]
        free = found | {f.name: f for law in of for f in law.free}
        start = {**point, **{name: value for law in of for name, value in law.starts[0].items()}}
        return excess(fit(plant, list(free.values()), start, blocks, max_iterations=N_ITERATIONS).residuals)

    full, support = leave(terms), []
    for term in terms:
        taken = 1.0 - full / max(leave([t for t in terms if t is not term]), 1e-300)
        promised = term.power / max(term.power + b.left - b.noise, 1e-300)
        support.append(min(max(taken, 0.0) / promised, 1.0))
    return support
