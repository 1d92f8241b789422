"""Linearised identification, eq. (3) of the paper:   Δi = A Δk,   solved by QR in one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.core.status import Reason

from .estimate import Estimate
from .fit import Problem, concluded, enough, not_estimated
from .measurement import Measurement
from .noise import NoiseModel
from .nuisance import N_FAULTS, NONE, Nuisance

if TYPE_CHECKING:
    from ema.bundle import Bundle


class Linear:
    """One linear solve per cycle, weighted by the noise model, bounded to 0 ≤ k ≤ 1.

    Parameters
    ----------
    i0 : array, shape (n_omega,)
        Nominal envelope at the schedule. [A]
    A : array, shape (n_omega, 6 + m)
        Jacobian ∂i/∂x at zero, x = [k; ν]. [A]
    nuisance : Nuisance
        What ν is, m elements.
    """

    method = "linear"

    def __init__(self, i0: np.ndarray, A: np.ndarray, noise: NoiseModel, nuisance: Nuisance = NONE):
        self.i0, self.A, self.noise, self.nuisance = i0, A, noise, nuisance

    def estimate(self, measurement: Measurement) -> Estimate:
        """Solve (3); the covariance of the residual is that of the size of faults found in a first pass."""
        if not enough(measurement):
            return not_estimated(self.method, measurement, Reason.GAP_AT_SCHEDULE)
        v = measurement.valid
        A, x = self.A.copy(), np.zeros(self.A.shape[1])
        shift, *with_faults = self.noise.start_shift(
            measurement.start, np.vstack([np.zeros(N_FAULTS), np.eye(N_FAULTS)])
        )
        A[:, :N_FAULTS] += (with_faults - shift).T  # the start's influence is linear in k
        problem = Problem(x, A[v], (measurement.i_hat - self.i0 - shift)[v])
        for _ in range(3):  # weights depend on the size of the faults, and the other way round
            white = problem.whitener(measurement, self.noise, self.nuisance, x)
            solution = problem.solved(white, self.nuisance)
            x = solution.x
        return concluded(self.method, measurement, self.noise, self.nuisance, problem, solution, white)


def make(bundle: Bundle) -> Linear:
    """The linear identifier of a bundle."""
    A = np.hstack([bundle.A, bundle.N])
    return Linear(bundle.i0[bundle.schedule], A, bundle.noise("linear"), bundle.nuisance)
