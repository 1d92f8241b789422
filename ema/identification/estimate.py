"""What an identifier says: faults with uncertainty, a test of fit, and how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.status import Reason, Status

from .nuisance import Edges, NuisanceEstimate
from .truncated import Marginals
from .unbounded import Unbounded


@dataclass(frozen=True)
class Estimate:
    """Estimated fault vector of one cycle.

    Attributes
    ----------
    method : str
        Name of the identifier.
    k, sd : arrays, shape (6,)
        Estimate, each within 0…1, and its standard deviation (root mean square error expected, bounds known).
    covariance : array, shape (6, 6)
        Covariance before the bounds.
    chi2, dof, p_value : float, int, float
        Weighted sum of squared residuals, its degrees of freedom, probability of a larger one if the model holds.
    residual : array, shape (n_omega,)
        Measured less modelled envelope at the schedule; NaN where the measurement is not valid. [A]
    marginals : Marginals or None
        Distribution of each fault within its bounds, if there is an estimate.
    unseparable : tuple of array, shape (6,)
        Directions of k that this cycle's data leave open (unit vectors).
    nuisance : NuisanceEstimate or None
        What was estimated beside the faults, if the bundle carries nuisance parameters.
    unbounded : Unbounded or None
        The estimate before the bounds, if there is one.
    edges : Edges or None
        How far faults may go while nuisance parameters make up for them; intervals reach as far.
    """

    method: str
    k: np.ndarray
    sd: np.ndarray
    covariance: np.ndarray
    chi2: float
    dof: int
    p_value: float
    residual: np.ndarray
    status: Status
    reasons: Reason
    marginals: Marginals | None = None
    unseparable: tuple[np.ndarray, ...] = ()
    nuisance: NuisanceEstimate | None = None
    edges: Edges | None = None
    unbounded: Unbounded | None = None

    def interval(self, level: float) -> np.ndarray:
        """Shortest intervals that hold each fault with probability `level`, shape (6, 2); NaN without an estimate."""
        if self.marginals is None:
            return np.full((len(self.k), 2), np.nan)
        limits = self.marginals.shortest(level)
        return limits if self.edges is None else self.edges.widened(limits, level, slice(None, len(self.k)))
