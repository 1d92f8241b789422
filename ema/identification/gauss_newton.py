"""Iterative identification, eq. (4) of the paper, one for every model:   k_j = k_{j-1} + C (AᵀA)⁻¹ Aᵀ Δi_j.

The model is any function from fault vectors and a start state to envelopes at the schedule. Each step asks it once:
for the base point (several times, if its answers are noisy) and all columns of A, so that they can run as one batch.
C is one; a step that does not reduce the weighted residual is taken back and tried again with half of it.
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

# (fault vectors (m, 6), start state (2,) or None) → envelopes at the schedule (m, n_omega)
Model = Callable[[np.ndarray, "np.ndarray | None"], np.ndarray]


class Options(NamedTuple):
    """How the iteration runs.

    `dk`: finite-difference step, both ways if `central`; `n_base`: runs averaged at the base point, more than one for
    a model whose answers are noisy; `n_steps`: most calls of the model; `tolerance`: change of k [in its standard
    deviations] below which it has converged.
    """

    dk: float = 1e-3
    central: bool = False
    n_base: int = 1
    n_steps: int = 25
    tolerance: float = 0.01


class _Linearised(NamedTuple):
    """Model about `k` (6,): Jacobian `A` (n_valid, 6) and measured less modelled envelope (n_valid,)."""

    k: np.ndarray
    A: np.ndarray
    residual: np.ndarray


class GaussNewton:
    """Gauss–Newton on a model, weighted by the noise model, bounded to 0 ≤ k ≤ 1."""

    def __init__(self, method: str, model: Model, noise: NoiseModel, start_from: Callable[[Measurement], np.ndarray],
                 options: Options = Options()):  # noqa: B008 - immutable  # fmt: skip
        self.method, self.model, self.noise, self.start_from, self.options = method, model, noise, start_from, options

    def estimate(self, measurement: Measurement) -> Estimate:
        """Iterate from the warm start until the step is small."""
        if not enough(measurement):
            return not_estimated(self.method, measurement, Reason.GAP_AT_SCHEDULE)
        at = self._linearised(np.clip(self.start_from(measurement), 0.0, 1.0), measurement)
        seen, C = [at], 1.0
        white = self._whitener(measurement, at.k)
        while len(seen) < self.options.n_steps:
            solution = bounded_least_squares(white(at.A), white(at.residual), -at.k, 1.0 - at.k)
            step = C * solution.x
            if np.max(np.abs(step) / np.sqrt(np.diag(solution.covariance))) < self.options.tolerance:
                break
            tried = self._linearised(at.k + step, measurement)
            seen.append(tried)
            if np.sum(white(tried.residual) ** 2) < np.sum(white(at.residual) ** 2):
                at, C = tried, min(1.0, 2.0 * C)
                white = self._whitener(measurement, at.k)
            else:
                C *= 0.5
        at, n_averaged = self._averaged(at, seen)
        white = self._whitener(measurement, at.k, n_averaged)
        solution = bounded_least_squares(white(at.A), white(at.residual), -at.k, 1.0 - at.k)
        residual = at.residual - at.A @ solution.x
        return concluded(self.method, measurement, self.noise, at.k, solution, residual, white)

    def _averaged(self, at: _Linearised, seen: list[_Linearised]) -> tuple[_Linearised, int]:
        """Mean of all linearisations within one finite difference of `at`, and how many base runs went into it.

        A noisy model is asked more than once about nearly the same point; none of its answers should be lost.
        """
        near = [x for x in seen if np.abs(x.k - at.k).max() <= self.options.dk]
        A = np.mean([x.A for x in near], axis=0)
        residual = np.mean([x.residual + A @ (x.k - at.k) for x in near], axis=0)
        return _Linearised(at.k, A, residual), self.options.n_base * len(near)

    def _whitener(self, measurement: Measurement, k: np.ndarray, n_averaged: int | None = None) -> Whitener:
        v = measurement.valid
        covariance = self.noise.covariance(measurement.start, k)
        if self.options.n_base > 1:  # a noisy model: its own runs differ as measured ones do
            covariance = covariance + self.noise.switching / (n_averaged or self.options.n_base)
        return Whitener(covariance[np.ix_(v, v)])

    def _linearised(self, k: np.ndarray, measurement: Measurement) -> _Linearised:
        """Differences stay within the bounds: one-sided (or shortened) where k is near one."""
        o, v = self.options, measurement.valid
        up, down = np.minimum(o.dk, 1.0 - k), np.minimum(o.dk, k)
        if not o.central:
            up, down = np.where(up >= down, up, 0.0), np.where(up >= down, 0.0, down)
        sides = [k + np.diag(up), k - np.diag(down)] if o.central else [k + np.diag(up - down)]
        i = self.model(np.vstack([np.tile(k, (o.n_base, 1)), *sides]), measurement.start)[:, v]
        base = i[: o.n_base].mean(axis=0)
        if o.central:
            A = (i[o.n_base : o.n_base + 6] - i[o.n_base + 6 :]) / (up + down)[:, None]
        else:
            A = (i[o.n_base :] - base) / (up - down)[:, None]
        return _Linearised(k, A.T, measurement.i_hat[v] - base)
