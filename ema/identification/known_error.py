"""What the builder knows of a model's error: HF less model at the schedule, regressed on the faults.

e(k) = Σ_α c_α k^α,   monomials of degree 1 to 4 in k₁ … k₆ (209 of them)
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

DEGREE = 4
RIDGES = 10.0 ** np.arange(-8.0, 0.0)  # candidates, relative to each monomial's own energy
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
        """Ridge regression of `error` (n, n_omega) on `k` (n, 6), the ridge by generalised cross-validation [1]_.

        What no such polynomial can follow grows with the faults: beyond the size `knee` a run counts less, by
        (knee/‖k‖)⁴.

        References
        ----------
        .. [1] Golub, Heath, Wahba, Technometrics 21 (1979) 215.
        """
        w = 1.0 / np.sqrt(1.0 + (np.linalg.norm(k, axis=1) / knee) ** 4)[:, None]
        F = monomials(k) * w
        scale = np.linalg.norm(F, axis=0)
        U, s, Vt = np.linalg.svd(F / scale, full_matrices=False)
        y = error * w
        c = U.T @ y
        rest = float(np.sum(y**2) - np.sum(c**2))

        def gcv(ridge: float) -> float:
            damped = ridge / (s**2 + ridge)
            return (rest + float(np.sum((damped[:, None] * c) ** 2))) / (len(k) - np.sum(1.0 - damped)) ** 2

        ridge = min(RIDGES, key=gcv)
        return cls(Vt.T @ ((s / (s**2 + ridge))[:, None] * c) / scale[:, None])
