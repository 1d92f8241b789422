"""What a law of another form may leave: one covariance for all hypotheses.

One that grew with a hypothesis's own response could be bought: large effects that cancel would forgive each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .hypothesis import Array

# Share of what faults alone leave that the true cause may leave, and how likely that is. A law is as likely as not the
# library's own; one of another form leaves any of these.
SHARES = {0.0: 0.5, 0.003: 0.125, 0.01: 0.125, 0.03: 0.125, 0.1: 0.125}
NO_SHARE = {0.0: 1.0}


@dataclass(frozen=True)
class LawError:
    """D = δ² |r|² I / d, where r is what faults alone leave of the d statistics.

    As much in every direction: along candidates' columns a pair of nearly parallel ones that cancel would be bought.

    Attributes
    ----------
    d : int
    left : float
        |r|², beyond noise.
    rest : float
        The same outside the statistics.
    """

    d: int
    left: float
    rest: float

    @classmethod
    def of(cls, residual: Array, rest: float) -> LawError:
        """From what faults alone leave of the statistics (d,), and outside of them."""
        return cls(len(residual), max(float(residual @ residual) - len(residual), 0.0), max(rest, 0.0))

    def covariance(self, share: float) -> Array:
        """D for a share δ."""
        return np.asarray(share**2 * self.left * np.eye(self.d) / self.d)

    def of_rest(self, share: float) -> float:
        """Expected square outside the statistics for a share δ."""
        return share**2 * (self.rest + self.left)
