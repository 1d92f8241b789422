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
from .fit import Problem, concluded, enough, not_estimated
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import NONE, Nuisance
from .weighted import Whitener

# (points x = [k; ν] (n, 6 + m), start state (2,) or None) → envelopes at the schedule (n, n_omega)
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
        seen, C = [at], 1.0
        white = self._whitener(measurement, at)
        while len(seen) < self.options.n_steps:
            solution = at.solved(white, self.nuisance)
            step = C * solution.x
            if np.max(np.abs(step) / np.sqrt(np.diag(solution.covariance))) < self.options.tolerance:
                break
            tried = self._linearised(at.x + step, measurement)
            seen.append(tried)
            if self._cost(tried, white) < self._cost(at, white):
                at, C = tried, min(1.0, 2.0 * C)
                white = self._whitener(measurement, at)
            else:
                C *= 0.5
        at, n_averaged = self._averaged(at, seen)
        white = self._whitener(measurement, at, n_averaged)
        solution = at.solved(white, self.nuisance)
        return concluded(self.method, measurement, self.noise, self.nuisance, at, solution, white)

    def _cost(self, at: Problem, white: Whitener) -> float:
        return float(np.sum(white(at.r) ** 2) + np.sum((self.nuisance.prior @ at.x) ** 2))

    def _averaged(self, at: Problem, seen: list[Problem]) -> tuple[Problem, int]:
        """Mean of all linearisations within one finite difference of `at`, and how many base runs went into it.

        A noisy model is asked more than once about nearly the same point; none of its answers should be lost.
        """
        near = [p for p in seen if np.abs(p.x - at.x).max() <= self.options.dk]
        A = np.mean([p.A for p in near], axis=0)
        residual = np.mean([p.r + A @ (p.x - at.x) for p in near], axis=0)
        return Problem(at.x, A, residual), self.options.n_base * len(near)

    def _whitener(self, measurement: Measurement, at: Problem, n_averaged: int | None = None) -> Whitener:
        n = self.options.n_base  # more than one: a noisy model, whose own runs differ as measured ones do
        n_own = (n_averaged or n) if n > 1 else np.inf
        return at.whitener(measurement, self.noise, self.nuisance, at.x, n_own)

    def _linearised(self, x: np.ndarray, measurement: Measurement) -> Problem:
        """Differences stay within the bounds: one-sided (or shortened) where x is near one."""
        o, v, d = self.options, measurement.valid, len(x)
        up, down = np.minimum(o.dk, self._high - x), np.minimum(o.dk, x - self._low)
        if not o.central:
            up, down = np.where(up >= down, up, 0.0), np.where(up >= down, 0.0, down)
        sides = [x + np.diag(up), x - np.diag(down)] if o.central else [x + np.diag(up - down)]
        i = self.model(np.vstack([np.tile(x, (o.n_base, 1)), *sides]), measurement.start)[:, v]
        base = i[: o.n_base].mean(axis=0)
        if o.central:
            A = (i[o.n_base : o.n_base + d] - i[o.n_base + d :]) / (up + down)[:, None]
        else:
            A = (i[o.n_base :] - base) / (up - down)[:, None]
        return Problem(x, A.T, measurement.i_hat[v] - base)
