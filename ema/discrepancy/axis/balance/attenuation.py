"""What noise in the regressors takes from each coefficient, undone by simulation and extrapolation.

Position and speed stand among the regressors with their noise, so least squares finds too little of what they carry.
The records are given their noise once more; by what that moves a coefficient, their own noise has moved it already
(to first order in its variance).

References
----------
Cook and Stefanski, "Simulation-extrapolation estimation in parametric measurement error models", Journal of the
American Statistical Association 89, 1994.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .course import Course
from .integrated import integrate_rows
from .regression import Corrected, Plain, Regression, regress

if TYPE_CHECKING:
    from ema.discrepancy.axis.measured import Measured

N_DRAWS = 4
UNSURE = 0.5  # of the correction, as its standard deviation


def attenuation(
    plant: Measured,
    courses: list[Course],
    halves: dict[str, float],
    plain: Plain,
    model: Regression,
    unsure: float,
) -> Corrected:
    """Coefficients of `model` with the effect of the sensors' noise undone."""
    rng = np.random.default_rng(0)
    moved = []
    for _ in range(N_DRAWS if any(not c.static for c in courses) else 0):
        noisier = integrate_rows(plant, [c if c.static else c.disturbed(rng) for c in courses], halves, unsure)
        if noisier is not None:
            again = regress(noisier, plain, model.laws)
            if again.base == model.base:
                moved.append(again.coefficients - model.coefficients)
    if len(moved) < 2:
        return Corrected(model.coefficients, model.covariance())
    shift = np.mean(moved, axis=0)
    scatter = np.cov(np.array(moved).T).reshape(len(shift), len(shift)) / len(moved)
    covariance = model.covariance() + scatter + UNSURE**2 * np.diag(shift**2)
    return Corrected(model.coefficients - shift, covariance)
