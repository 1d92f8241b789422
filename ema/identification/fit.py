"""From a solved problem to an `Estimate`: uncertainty within the bounds, test of fit, status and reasons."""

from __future__ import annotations

import numpy as np

from ema.core.status import Reason, Status

from .estimate import Estimate
from .measurement import Measurement
from .weighted import Whitener, p_value

AT_BOUND = 1e-9


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
    k: np.ndarray,
    covariance: np.ndarray,
    residual: np.ndarray,
    white: Whitener,
) -> Estimate:
    """Make the estimate from `k`, its covariance (6, 6) and the residual at the valid instants (n_valid,)."""
    w = white(residual)
    chi2 = float(w @ w)
    dof = max(len(residual) - int(np.sum((k > AT_BOUND) & (k < 1.0 - AT_BOUND))), 1)
    full = np.full(len(measurement.i_hat), np.nan)
    full[measurement.valid] = residual
    reasons = Reason(0)
    if (k <= AT_BOUND).any() or (k >= 1.0 - AT_BOUND).any():
        reasons |= Reason.AT_BOUND
    if measurement.start is None:
        reasons |= Reason.START_STATE_UNKNOWN
    if not measurement.valid.all():
        reasons |= Reason.GAP_AT_SCHEDULE
    status = Status.VALID if measurement.valid.all() else Status.INVALID
    sd = np.sqrt(np.diag(covariance))
    return Estimate(method, k, sd, covariance, chi2, dof, p_value(chi2, dof), full, status, reasons)


def enough(measurement: Measurement) -> bool:
    """Whether the valid, finite instants determine six faults with something left to test the fit."""
    usable = measurement.valid & np.isfinite(measurement.i_hat)
    return bool(usable.sum() >= 8 and np.isfinite(measurement.i_hat[measurement.valid]).all())
