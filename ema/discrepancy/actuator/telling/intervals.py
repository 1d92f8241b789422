"""How far off faults may be: by the score, and by a rest that nothing explains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.actuator.fitting.fit import stacked_jacobian
from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.engine.contest import Outcome

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

FORM = 0.5  # of a value, for a rest as large as the whole effect: the interval holds what would take all of the rest


@dataclass(frozen=True)
class Size:
    """A value and its standard deviation."""

    value: float
    sd: float


def of_faults(model: Model, outcome: Outcome) -> dict[str, Size]:
    """Faults by the score, which drops those that are not there, over all sets; by the fit where none was weighed."""
    if any(set(w.entrant.names) == set(model.names) for w in outcome.weighed):
        return {name: Size(*of) for name, of in outcome.sizes_of_faults(FAULTS).items()}
    return {name: Size(model.fit.point.get(name, 0.0), model.fit.sd.get(name, 0.0)) for name in FAULTS}


def hold_rest(search: Search, model: Model, faults: Mapping[str, Size]) -> dict[str, Size]:
    """Faults with deviations that hold what a rest, which is no noise, may have made of them.

    A friction that comes and goes is on average a larger one, and what is left of it says how much of that may be no
    fault.
    """
    of_rest = _by_rest(search, model)
    return {n: replace(of, sd=float(np.hypot(of.sd, FORM * of_rest.get(n, 0.0)))) for n, of in faults.items()}


def _by_rest(search: Search, model: Model) -> dict[str, float]:
    """By how much each parameter would be off at most, were there as much again of what each balance leaves."""
    plant, noise, fit = search.plant, search.noise, model.fit
    off, length = np.zeros(len(fit.free)), np.full(len(fit.free), 1e-300)
    for c in search.train:
        J = stacked_jacobian(noise, fit.free, fit.columns, [c])
        for at in plant.slices[int(plant.data.motion[c])].values():
            of_noise = float((noise.of(c).fresh[:, at] ** 2).sum(axis=1).mean())
            left = max(float(fit.residuals[c][at] @ fit.residuals[c][at]) - of_noise, 0.0)
            off += np.sqrt(left) * np.linalg.norm(J[at], axis=0)
        length += (J**2).sum(axis=0)
    return {f.name: float(x) for f, x in zip(fit.free, off / length, strict=True)}
