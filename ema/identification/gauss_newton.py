"""Iterative identification, eq. (4) of the paper, one for every model:   k_j = k_{j-1} + C (AᵀA)⁻¹ Aᵀ Δi_j.

The model is any function from fault vectors and a start state to envelopes at the schedule. Each step asks it once:
for the base point and all columns of A, so that they can run as one batch. How a noisy model is asked: `hf`.
C is one; a step that does not reduce the weighted residual is taken back and tried again with half of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ema.core.status import Reason

from .estimate import Estimate
from .fit import Problem, concluded, enough, not_estimated
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import NONE, Nuisance
from .weighted import Whitener

# (points x = [k; ν] (n, 6 + m), start state (2,) or None) → envelopes at the schedule (n, n_omega)
Model = Callable[[np.ndarray, "np.ndarray | None"], np.ndarray]


class Options(NamedTuple):
    """How the iteration runs.

    `dk`: finite-difference step; `n_steps`: most calls of the model; `tolerance`: change of k [in its standard
    deviations] below which it has converged.
    """

    dk: float = 1e-3
    n_steps: int = 25
    tolerance: float = 0.01


class GaussNewton:
    """Gauss–Newton on a model, weighted by the noise model, bounded to 0 ≤ k ≤ 1; nuisance parameters beside k."""

    def __init__(self, method: str, model: Model, noise: NoiseModel, start_from: Callable[[Measurement], np.ndarray],
                 options: Options = Options(), nuisance: Nuisance = NONE):  # noqa: B008 - immutable  # fmt: skip
        self.method, self.model, self.noise, self.start_from, self.options = method, model, noise, start_from, options
        self.nuisance = nuisance
        self._low, self._high = nuisance.bounds

    def estimate(self, measurement: Measurement) -> Estimate:
        """Iterate from the warm start until the step is small."""
        if not enough(measurement):
            return not_estimated(self.method, measurement, Reason.GAP_AT_SCHEDULE)
        at = self._linearised(np.clip(self.start_from(measurement), self._low, self._high), measurement)
        n_steps, C = 1, 1.0
        white = self._whitener(measurement, at)
        while n_steps < self.options.n_steps:
            solution = at.solved(white, self.nuisance)
            step = C * solution.x
            if np.max(np.abs(step) / np.sqrt(np.diag(solution.covariance))) < self.options.tolerance:
                break
            tried = self._linearised(at.x + step, measurement)
            n_steps += 1
            if self._cost(tried, white) < self._cost(at, white):
                at, C = tried, min(1.0, 2.0 * C)
                white = self._whitener(measurement, at)
            else:
                C *= 0.5
        solution = at.solved(white, self.nuisance)
        return concluded(self.method, measurement, self.noise, self.nuisance, at, solution, white)

    def _cost(self, at: Problem, white: Whitener) -> float:
        return float(np.sum(white(at.r) ** 2) + np.sum((self.nuisance.prior @ at.x) ** 2))

    def _whitener(self, measurement: Measurement, at: Problem) -> Whitener:
        return at.whitener(measurement, self.noise, self.nuisance, at.x)

    def _linearised(self, x: np.ndarray, measurement: Measurement) -> Problem:
        """One-sided differences, to the side where the bound is farther."""
        v = measurement.valid
        up, down = np.minimum(self.options.dk, self._high - x), np.minimum(self.options.dk, x - self._low)
        dx = np.where(up >= down, up, -down)
        i = self.model(np.vstack([x, x + np.diag(dx)]), measurement.start)[:, v]
        return Problem(x, ((i[1:] - i[0]) / dx[:, None]).T, measurement.i_hat[v] - i[0])
