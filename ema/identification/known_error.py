"""What the builder knows of a model's error: HF less model at the schedule, regressed on the faults.

e(k) = Σ_α c_α k^α,   monomials of degree 1 to 3 in k₁ … k₆ (83 of them)
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

DEGREE = 3
_TERMS = [c for degree in range(1, DEGREE + 1) for c in combinations_with_replacement(range(6), degree)]
_PADDED = np.array([(*c, *(6,) * (DEGREE - len(c))) for c in _TERMS])  # element 6 stands for the number one
N_TERMS = len(_TERMS)


def monomials(k: np.ndarray) -> np.ndarray:
    """All monomials of fault vectors `k` (..., 6), shape (..., N_TERMS)."""
    k = np.concatenate([k, np.ones((*np.shape(k)[:-1], 1))], axis=-1)
    return np.asarray(k[..., _PADDED].prod(axis=-1))


class KnownError:
    """The regressed error; `coefficients` (N_TERMS, n_omega). [A]"""

    def __init__(self, coefficients: np.ndarray):
        self.coefficients = coefficients

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Error for fault vectors `k` (..., 6), shape (..., n_omega). [A]"""
        return monomials(k) @ self.coefficients

    @classmethod
    def fitted(cls, k: np.ndarray, error: np.ndarray, knee: float) -> KnownError:
        """Ridge regression of `error` (n, n_omega) on `k` (n, 6).

        What no cubic can follow grows with the faults: beyond the size `knee` a run counts less, by (knee/‖k‖)⁴.
        """
        F = monomials(k)
        weighted = F / (1.0 + (np.linalg.norm(k, axis=1) / knee) ** 4)[:, None]
        G = F.T @ weighted
        return cls(np.linalg.solve(G + 1e-7 * np.diag(np.diag(G)), weighted.T @ error))
