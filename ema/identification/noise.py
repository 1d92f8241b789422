"""How much a measured envelope may differ from a model's: by switching, by the model's own error, by the start state.

    Σ(k, start) = Σ_switch + M(‖k‖) + d² Σ_start

Σ_switch: two runs of the same actuator differ by what decides its comparators. M: covariance of the model's error for
faults of a size, measured by the builder on held-out faults at some sizes (it follows no simple power) and interpolated
in ‖k‖². Σ_start: what is left of the start state's influence when its linear part is taken off; it grows
with the distance d of the start from the middle of the gap at zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

D2_UNKNOWN = 4.0  # d² if nobody measured the start
D2_MAX = 25.0


@dataclass(frozen=True)
class NoiseModel:
    """Covariances at the schedule and the start state's linear influence.

    Attributes
    ----------
    switching : array, shape (n_omega, n_omega)
        Covariance of one run of an actuator. [A²]
    sizes : array, shape (m,)
        Sizes ‖k‖ at which the model's error was measured, ascending from 0. [1]
    model_error : array, shape (m, n_omega, n_omega)
        Covariance of the model's error at these sizes. [A²]
    start : array, shape (n_omega, n_omega)
        Covariance for a start at d = 1. [A²]
    B : array, shape (n_omega, 2)
        Linear influence of the start state: user position, gear output. [A/rad]
    start_scale : array, shape (2,)
        Start offsets for which d is 1. [rad]
    """

    switching: np.ndarray
    sizes: np.ndarray
    model_error: np.ndarray
    start: np.ndarray
    B: np.ndarray
    start_scale: np.ndarray

    def start_shift(self, start: np.ndarray | None) -> np.ndarray:
        """Linear influence of the start state on the envelope, shape (n_omega,). [A]"""
        return np.zeros(len(self.B)) if start is None else self.B @ start

    def covariance(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """Σ for a cycle that began at `start` with faults near `k`."""
        d2 = D2_UNKNOWN if start is None else min(float(np.sum((start / self.start_scale) ** 2)), D2_MAX)
        return self.switching + self._at_size(k) + d2 * self.start

    def _at_size(self, k: np.ndarray) -> np.ndarray:
        s2, q = self.sizes**2, float(k @ k)
        if q >= s2[-1]:
            return self.model_error[-1] * (q / s2[-1] if s2[-1] > 0 else 1.0)
        upper = int(np.searchsorted(s2, q, side="right"))
        share = (q - s2[upper - 1]) / (s2[upper] - s2[upper - 1])
        return (1.0 - share) * self.model_error[upper - 1] + share * self.model_error[upper]

    def beyond(self, k: np.ndarray) -> bool:
        """Whether the faults are clearly larger than any the model was measured for."""
        return bool(np.sqrt(k @ k) > 1.25 * self.sizes[-1])
