"""How much a measured envelope may differ from a model's: switching noise, start state, and the model's own error.

    Σ = Σ_switch + d² Σ_start + ‖k̂‖⁴ M

Σ_switch: two runs of the same actuator differ by what decides its comparators. Σ_start: what is left of the start
state's influence when its linear part is taken off; it grows with the distance d of the start from the middle of the
gap at zero. M: error of the model in use, which grows with the square of the faults. The builder measures all three.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NoiseModel:
    """Covariances at the schedule, each (n_omega, n_omega), and the start state's linear influence `B` (n_omega, 2).

    `start_scale` (2,) are the start offsets (user, gear output) for which d is 1. [rad]
    """

    switching: np.ndarray
    start: np.ndarray
    B: np.ndarray
    start_scale: np.ndarray
    model_error: np.ndarray

    def start_shift(self, start: np.ndarray | None) -> np.ndarray:
        """Linear influence of the start state on the envelope, shape (n_omega,). [A]"""
        return np.zeros(len(self.B)) if start is None else self.B @ start

    def covariance(self, start: np.ndarray | None, k: np.ndarray) -> np.ndarray:
        """Σ for a cycle that began at `start` (unknown: twice the scale) with faults near `k`."""
        d2 = 4.0 if start is None else float(np.sum((start / self.start_scale) ** 2))
        return self.switching + min(d2, 25.0) * self.start + float(k @ k) ** 2 * self.model_error
