"""From a solved problem to an `Estimate`: uncertainty within the bounds, test of fit, status and reasons."""

from __future__ import annotations

import numpy as np

from ema.core.status import Reason, Status

from .estimate import Estimate
from .measurement import Measurement
from .noise import NoiseModel
from .truncated import in_unit_box
from .weighted import Solution, Whitener, p_value

AT_BOUND = 1e-9
DOUBT_LEVEL = 1e-3  # share of sound cycles whose test of fit may fail
OPEN = 0.15  # a direction of k with a larger standard deviation is called unseparable [share of a complete failure]


def not_estimated(method: str, measurement: Measurement, reasons: Reason) -> Estimate:
    """The answer when there is nothing to answer from."""
    nan = np.full(6, np.nan)
    return Estimate(
        *(method, nan, nan, np.full((6, 6), np.nan), np.nan, 0, np.nan, np.full(len(measurement.i_hat), np.nan)),
        status=Status.NOT_ESTIMATED,
        reasons=reasons,
    )


def concluded(
    method: str,
    measurement: Measurement,
    noise: NoiseModel,
    k: np.ndarray,
    solution: Solution,
    residual: np.ndarray,
    white: Whitener,
) -> Estimate:
    """Make the estimate.

    Parameters
    ----------
    k : array, shape (6,)
        Point of linearisation; the solution is the last step from there.
    residual : array, shape (n_valid,)
        Measured less modelled envelope after that step. [A]
    """
    answer, covariance = k + solution.x, solution.covariance
    marginals = in_unit_box(k + solution.free, covariance)
    sd = np.sqrt(marginals.variance + (marginals.mean - answer) ** 2)
    w = white(residual)
    chi2 = float(w @ w)
    at_bound = (answer <= AT_BOUND) | (answer >= 1.0 - AT_BOUND)
    dof = max(len(residual) - int(np.sum(~at_bound)), 1)
    p = p_value(chi2, dof)
    full = np.full(len(measurement.i_hat), np.nan)
    full[measurement.valid] = residual
    open_directions = unseparable(covariance)
    reasons = Reason(0)
    for reason, applies in (
        (Reason.AT_BOUND, at_bound.any()),
        (Reason.START_STATE_UNKNOWN, measurement.start is None),
        (Reason.GAP_AT_SCHEDULE, not measurement.valid.all()),
        (Reason.MODEL_IN_DOUBT, p < DOUBT_LEVEL),
        (Reason.UNSEPARABLE, bool(open_directions)),
        (Reason.OUT_OF_RANGE, noise.beyond(answer)),
    ):
        reasons |= reason if applies else Reason(0)
    status = Status.VALID
    if reasons & (Reason.MODEL_IN_DOUBT | Reason.UNSEPARABLE | Reason.OUT_OF_RANGE):
        status = Status.DEGRADED
    if reasons & Reason.GAP_AT_SCHEDULE:
        status = Status.INVALID
    return Estimate(
        *(method, answer, sd, covariance, chi2, dof, p, full, status, reasons), marginals, open_directions
    )  # fmt: skip


def unseparable(covariance: np.ndarray) -> tuple[np.ndarray, ...]:
    """Principal directions of the covariance (6, 6) that the data leave open, the most uncertain first."""
    variance, direction = np.linalg.eigh(covariance)
    return tuple(direction[:, j] for j in np.argsort(variance)[::-1] if variance[j] > OPEN**2)


def enough(measurement: Measurement) -> bool:
    """Whether the valid, finite instants determine six faults with something left to test the fit."""
    usable = measurement.valid & np.isfinite(measurement.i_hat)
    return bool(usable.sum() >= 8 and np.isfinite(measurement.i_hat[measurement.valid]).all())
