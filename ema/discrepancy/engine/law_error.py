"""What a law of another form may leave: one covariance for all hypotheses.

One that grew with a hypothesis's own response could be bought: large effects that cancel would forgive each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .hypothesis import Array

# Share of what faults alone leave that the true cause may leave, being a law of another form; each as likely.
SHARES = (0.0, 0.003, 0.01, 0.03, 0.1)


@dataclass(frozen=True)
class LawError:
    """D = δ² |r|² U Uᵀ / n, where r is what faults alone leave and U the n unit columns of all candidates.

    Attributes
    ----------
    shape : array, shape (d, d)
        Of unit trace.
    left : float
        |r|², beyond noise.
    rest : float
        The same outside the candidates' span.
    """

    shape: Array
    left: float
    rest: float

    @classmethod
    def of(cls, columns: Array, residual: Array, rest: float) -> LawError:
        """From projected columns (d, n) of all candidates and what faults alone leave (d,) and outside the span."""
        length = np.linalg.norm(columns, axis=0)
        U = columns[:, length > 0.0] / length[length > 0.0]
        return cls(U @ U.T / max(U.shape[1], 1), max(float(residual @ residual) - len(residual), 0.0), max(rest, 0.0))

    def covariance(self, share: float) -> Array:
        """D for a share δ."""
        return np.asarray(share**2 * self.left * self.shape)

    def of_rest(self, share: float) -> float:
        """Expected square outside the span for a share δ."""
        return share**2 * (self.rest + self.left)
