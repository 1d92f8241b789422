"""Linearised identification, eq. (3) of the paper:   Δi = A Δk,   solved by QR in one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.core.status import Reason

from .estimate import Estimate
from .fit import concluded, enough, not_estimated
from .measurement import Measurement
from .noise import NoiseModel
from .weighted import Whitener, bounded_least_squares

if TYPE_CHECKING:
    from ema.bundle import Bundle


class Linear:
    """One linear solve per cycle, weighted by the noise model, bounded to 0 ≤ k ≤ 1.

    Parameters
    ----------
    i0 : array, shape (n_omega,)
        Nominal envelope at the schedule. [A]
    A : array, shape (n_omega, 6)
        Jacobian ∂i/∂k at k = 0. [A]
    """

    method = "linear"

    def __init__(self, i0: np.ndarray, A: np.ndarray, noise: NoiseModel):
        self.i0, self.A, self.noise = i0, A, noise

    def estimate(self, measurement: Measurement) -> Estimate:
        """Solve (3); the covariance of the residual is that of the size of faults found in a first pass."""
        if not enough(measurement):
            return not_estimated(self.method, measurement, Reason.GAP_AT_SCHEDULE)
        v = measurement.valid
        delta = (measurement.i_hat - self.i0 - self.noise.start_shift(measurement.start))[v]
        A, low, high = self.A[v], np.zeros(6), np.ones(6)
        k = np.zeros(6)
        for _ in range(3):  # weights depend on the size of the faults, and the other way round
            white = Whitener(self.noise.covariance(measurement.start, k)[np.ix_(v, v)])
            solution = bounded_least_squares(white(A), white(delta), low, high)
            k = solution.x
        return concluded(self.method, measurement, self.noise, np.zeros(6), solution, delta - A @ k, white)


def make(bundle: Bundle) -> Linear:
    """The linear identifier of a bundle."""
    return Linear(bundle.i0[bundle.schedule], bundle.A, bundle.noise("linear"))
