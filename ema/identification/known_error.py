"""What the builder knows of a model's error: HF less model at the schedule, regressed on what is estimated.

e(x) = Σ_α c_α x^α,   monomials of degree 1 to 4 in x = [k₁ … k₆; ν] (209 of them without ν)
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement
from math import comb

import numpy as np

DEGREE = 4
RIDGES = 10.0 ** np.arange(-8.0, 0.0)  # candidates, relative to each monomial's own energy


def n_terms(d: int) -> int:
    """Number of monomials in `d` variables."""
    return comb(d + DEGREE, DEGREE) - 1


@cache
def _padded(d: int) -> np.ndarray:
    """Variables of each monomial, shape (n_terms, DEGREE); variable number `d` stands for the number one."""
    terms = (c for degree in range(1, DEGREE + 1) for c in combinations_with_replacement(range(d), degree))
    return np.array([(*c, *(d,) * (DEGREE - len(c))) for c in terms])


def monomials(x: np.ndarray) -> np.ndarray:
    """All monomials of points `x` (..., d), shape (..., n_terms(d))."""
    d = np.shape(x)[-1]
    x = np.concatenate([x, np.ones((*np.shape(x)[:-1], 1))], axis=-1)
    return np.asarray(x[..., _padded(d)].prod(axis=-1))


class KnownError:
    """The regressed error; `coefficients` (n_terms, n_omega). [A]"""

    def __init__(self, coefficients: np.ndarray):
        self.coefficients = coefficients

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Error at points `x` (..., d), shape (..., n_omega). [A]"""
        return monomials(x) @ self.coefficients

    @classmethod
    def fitted(cls, x: np.ndarray, error: np.ndarray, knee: float, slope: np.ndarray) -> KnownError:
        """Ridge regression of `error` (n, n_omega) on `x` (n, d), the ridge by generalised cross-validation [1]_.

        What no such polynomial can follow grows with the faults: beyond the size `knee` a run counts less, by
        (knee/‖x‖)⁴. A ridge draws coefficients towards zero; `slope` (d, n_omega), the error's derivative at zero as
        known beforehand, is what the linear ones are drawn to instead.

        References
        ----------
        .. [1] Golub, Heath, Wahba, Technometrics 21 (1979) 215.
        """
        w = 1.0 / np.sqrt(1.0 + (np.linalg.norm(x, axis=1) / knee) ** 4)[:, None]
        F = monomials(x) * w
        scale = np.linalg.norm(F, axis=0)
        U, s, Vt = np.linalg.svd(F / scale, full_matrices=False)
        y = (error - x @ slope) * w
        c = U.T @ y
        rest = float(np.sum(y**2) - np.sum(c**2))

        def gcv(ridge: float) -> float:
            damped = ridge / (s**2 + ridge)
            return (rest + float(np.sum((damped[:, None] * c) ** 2))) / (len(x) - np.sum(1.0 - damped)) ** 2

        ridge = min(RIDGES, key=gcv)
        coefficients = Vt.T @ ((s / (s**2 + ridge))[:, None] * c) / scale[:, None]
        coefficients[: len(slope)] += slope  # the first monomials are the elements of x themselves
        return cls(coefficients)
