"""Iterative identification, eq. (4) of the paper, one for every model:   k_j = k_{j-1} + C (AᵀA)⁻¹ Aᵀ Δi_j.

The model is any function from fault vectors (m, 6) to envelopes at the schedule (m, n_omega); base point and all
columns of A are asked for in one call. C starts at one and is halved until a step succeeds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ema.core.status import Reason

from .estimate import Estimate
from .fit import concluded, enough, not_estimated
from .measurement import Measurement
from .noise import NoiseModel
from .weighted import Whitener, bounded_least_squares

Model = Callable[[np.ndarray], np.ndarray]


class Options(NamedTuple):
    """How the iteration runs: finite-difference step, largest number of iterations, step at which it has converged."""

    dk: float = 1e-3
    n_iterations: int = 20
    tolerance: float = 1e-4


class GaussNewton:
    """Gauss–Newton on a model, weighted by the noise model, bounded to 0 ≤ k ≤ 1."""

    def __init__(self, method: str, model: Model, noise: NoiseModel, start_from: Callable[[Measurement], np.ndarray],
                 options: Options = Options()):  # noqa: B008 - immutable  # fmt: skip
        self.method, self.model, self.noise, self.start_from, self.options = method, model, noise, start_from, options

    def estimate(self, measurement: Measurement) -> Estimate:
        """Iterate from the warm start until the step is small."""
        if not enough(measurement):
            return not_estimated(self.method, measurement, Reason.GAP_AT_SCHEDULE)
        v = measurement.valid
        target = measurement.i_hat - self.noise.start_shift(measurement.start)
        k = np.clip(self.start_from(measurement), 0.0, 1.0)
        for _ in range(2):  # weights for the size of faults found so far, then once more
            white = Whitener(self.noise.covariance(measurement.start, k)[np.ix_(v, v)])
            k, A, residual = self._iterate(k, target, v, white)
        covariance = bounded_least_squares(white(A), white(residual), -k, 1.0 - k).covariance
        return concluded(self.method, measurement, k, covariance, residual, white)

    def _iterate(self, k: np.ndarray, target: np.ndarray, v: np.ndarray, white: Whitener) -> tuple[np.ndarray, ...]:
        A, residual = self._linearised(k, target, v)
        cost = float(np.sum(white(residual) ** 2))
        for _ in range(self.options.n_iterations):
            step = bounded_least_squares(white(A), white(residual), -k, 1.0 - k).x
            C = 2.0 ** -np.arange(6.0)
            candidates = k + C[:, None] * step
            costs = np.sum(white((target - self.model(candidates))[:, v].T) ** 2, axis=0)
            best = int(np.argmin(costs))
            if costs[best] >= cost * (1.0 - 1e-9):
                break
            moved = float(np.abs(candidates[best] - k).max())
            k, cost = candidates[best], float(costs[best])
            A, residual = self._linearised(k, target, v)
            if moved < self.options.tolerance:
                break
        return k, A, residual

    def _linearised(self, k: np.ndarray, target: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (n_valid, 6) by differences towards the inside of the bounds, and the residual (n_valid,)."""
        dk = np.where(k + self.options.dk <= 1.0, self.options.dk, -self.options.dk)
        i = self.model(np.vstack([k, k + np.diag(dk)]))[:, v]
        return ((i[1:] - i[0]) / dk[:, None]).T, target[v] - i[0]
