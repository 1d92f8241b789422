"""From a solved problem to an `Estimate`: uncertainty within the bounds, test of fit, status and reasons."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ema.core.status import Reason, Status

from .alike import CAUSE, common_shorts
from .estimate import Estimate
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import N_FAULTS, Edges, Nuisance, estimated, rivals
from .truncated import Marginals, in_unit_box
from .unbounded import AT_BOUND, Unbounded
from .weighted import Solution, Whitener, bounded_least_squares, p_value

DOUBT_LEVEL = 1e-3  # share of sound cycles whose test of fit may fail
PARTS = (slice(None, N_FAULTS), slice(N_FAULTS, None))
OPEN = 0.15  # a direction of k with a larger standard deviation is called unseparable [share of a complete failure]


def not_estimated(method: str, measurement: Measurement, reasons: Reason) -> Estimate:
    """The answer when there is nothing to answer from."""
    nan = np.full(6, np.nan)
    return Estimate(
        *(method, nan, nan, np.full((6, 6), np.nan), np.nan, 0, np.nan, np.full(len(measurement.i_hat), np.nan)),
        status=Status.NOT_ESTIMATED,
        reasons=reasons,
    )


class Problem(NamedTuple):
    """Least squares about `x` = [k; ν] (6 + m,): Jacobian `A` (n_valid, 6 + m) and residual `r` (n_valid,). [A]"""

    x: np.ndarray
    A: np.ndarray
    r: np.ndarray

    def whitener(self, measurement: Measurement, noise: NoiseModel, nuisance: Nuisance, x: np.ndarray) -> Whitener:
        """Weights for an answer near `x`."""
        v = np.ix_(measurement.valid, measurement.valid)
        covariance = noise.covariance(measurement.start, x)
        if len(nuisance):
            return Whitener(covariance[v] + nuisance.untrusted(x, self.A, noise.switching[v]))
        return Whitener(covariance[v])

    def whitened(self, white: Whitener, nuisance: Nuisance) -> tuple[np.ndarray, np.ndarray]:
        """Rows of unit variance, the prior's below those of the data."""
        P = nuisance.prior
        return np.vstack([white(self.A), P]), np.concatenate([white(self.r), -P @ self.x])

    def solved(self, white: Whitener, nuisance: Nuisance) -> Solution:
        """The step from `x` that stays within bounds."""
        low, high = nuisance.bounds
        return bounded_least_squares(*self.whitened(white, nuisance), low - self.x, high - self.x)


def concluded(
    method: str,
    measurement: Measurement,
    noise: NoiseModel,
    nuisance: Nuisance,
    problem: Problem,
    solution: Solution,
    white: Whitener,
) -> Estimate:
    """Make the estimate from the last step."""
    x, residual = problem.x + solution.x, problem.r - problem.A @ solution.x
    low, high = nuisance.bounds
    span = high - low
    inside = in_unit_box((problem.x + solution.free - low) / span, solution.covariance / np.outer(span, span))
    marginals, beside = (Marginals(*(column[part] for column in inside)) for part in PARTS)
    answer, covariance = x[:N_FAULTS], solution.covariance[:N_FAULTS, :N_FAULTS]
    sd = np.sqrt(marginals.variance + (marginals.mean - answer) ** 2)
    w = white(residual)
    chi2 = float(w @ w)
    at_bound = (answer <= AT_BOUND) | (answer >= 1.0 - AT_BOUND)
    dof = max(len(residual) - int(np.sum(~at_bound)) - len(nuisance), 1)
    p = p_value(chi2, dof)
    full = np.full(len(measurement.i_hat), np.nan)
    full[measurement.valid] = residual
    open_directions = unseparable(covariance)
    if CAUSE not in nuisance.names:
        open_directions += common_shorts(answer, covariance)
    nuisance_estimate, edges = None, None
    if len(nuisance):
        A, b = problem.whitened(white, nuisance)
        b = b + A @ problem.x
        others = rivals(nuisance, A, b, x, solution.covariance)
        differences = [other.x[:N_FAULTS] - answer for other in others]
        open_directions += tuple(d / np.linalg.norm(d) for d in differences)
        edges = Edges(A, b, x, nuisance.bounds, others)
        nuisance_estimate = estimated(nuisance, x, solution.covariance, beside, edges)
    reasons = Reason(0)
    for reason, applies in (
        (Reason.AT_BOUND, at_bound.any()),
        (Reason.START_STATE_UNKNOWN, measurement.start is None),
        (Reason.GAP_AT_SCHEDULE, not measurement.valid.all()),
        (Reason.MODEL_IN_DOUBT, p < DOUBT_LEVEL),
        (Reason.UNSEPARABLE, bool(open_directions)),
        (Reason.OUT_OF_RANGE, noise.beyond(x)),
    ):
        reasons |= reason if applies else Reason(0)
    status = Status.VALID
    if reasons & (Reason.MODEL_IN_DOUBT | Reason.UNSEPARABLE | Reason.OUT_OF_RANGE):
        status = Status.DEGRADED
    if reasons & Reason.GAP_AT_SCHEDULE:
        status = Status.INVALID
    return Estimate(
        *(method, answer, sd, covariance, chi2, dof, p, full, status, reasons), marginals, open_directions,
        nuisance_estimate, edges, _unbounded(measurement, noise, problem, solution, white),
    )  # fmt: skip


def _unbounded(
    measurement: Measurement, noise: NoiseModel, problem: Problem, solution: Solution, white: Whitener
) -> Unbounded:
    """The answer before the bounds; all of its covariance that is not of this cycle alone is shared by others."""
    v = np.ix_(measurement.valid, measurement.valid)
    w = white(white(problem.A @ solution.covariance[:, :N_FAULTS]), transposed=True)  # δk = wᵀ δi
    own = w.T @ noise.of_a_cycle(measurement.start, problem.x + solution.x)[v] @ w
    k = (problem.x + solution.free)[:N_FAULTS]
    return Unbounded(k, own, solution.covariance[:N_FAULTS, :N_FAULTS] - own)


def unseparable(covariance: np.ndarray) -> tuple[np.ndarray, ...]:
    """Principal directions of the covariance (6, 6) that the data leave open, the most uncertain first."""
    variance, direction = np.linalg.eigh(covariance)
    return tuple(direction[:, j] for j in np.argsort(variance)[::-1] if variance[j] > OPEN**2)


def enough(measurement: Measurement) -> bool:
    """Whether the valid, finite instants determine six faults with something left to test the fit."""
    usable = measurement.valid & np.isfinite(measurement.i_hat)
    return bool(usable.sum() >= 8 and np.isfinite(measurement.i_hat[measurement.valid]).all())
