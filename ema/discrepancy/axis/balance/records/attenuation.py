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

from collections.abc import Callable

import numpy as np

from ema.discrepancy.axis.balance.regressing.regression import Corrected, Plain, Regression, regress
from ema.discrepancy.axis.balance.regressing.rows import Rows

from .course import Course

N_DRAWS = 4
UNSURE = 0.5  # of the correction, as its standard deviation


def attenuation(
    courses: list[Course], integrate: Callable[[list[Course]], Rows | None], plain: Plain, model: Regression
) -> Corrected:
    """Coefficients of `model` with the effect of the sensors' noise undone; `integrate` makes rows of courses."""
    rng = np.random.default_rng(0)
    moved = []
    for _ in range(N_DRAWS if any(not c.static for c in courses) else 0):
        noisier = integrate([c if c.static else c.disturbed(rng) for c in courses])
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
