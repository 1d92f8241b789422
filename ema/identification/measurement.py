"""What an identifier sees of one cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Measurement:
    """One cycle, compressed to the bundle's schedule.

    Attributes
    ----------
    i_hat : array, shape (n_omega,)
        Envelope at the scheduled instants. [A]
    start : array, shape (2,), or None
        User position θ_u and rotor angle over gear ratio θ_m/GR when the cycle began, if both were measured. [rad, rad]
    valid : array of bool, shape (n_omega,)
        False where a gap in the data reaches the scheduled instant.
    """

    i_hat: np.ndarray
    start: np.ndarray | None
    valid: np.ndarray

    @classmethod
    def complete(cls, i_hat: np.ndarray, start: np.ndarray | None = None) -> Measurement:
        """A cycle without gaps."""
        return cls(np.asarray(i_hat, dtype=float), start, np.ones(len(i_hat), dtype=bool))
