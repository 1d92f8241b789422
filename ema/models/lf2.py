"""LF2, the signal emulator of the paper's eq. (1): a library of pre-computed envelopes combined by the fault vector.

    i(k) = [i₀ + i_SF f₁(k₁) + i_BLK(k₂)] · [1 + i_ζ(k₆) + Σ_j i_PH,j f₂(k_j)],   j = A, B, C

f₁ and f₂ are polynomials without constant term; i_BLK and i_ζ are functions of their fault, kept as tables over levels
and interpolated by shape-preserving cubics. Needs neither a JIT nor the HF model.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator


@dataclass(frozen=True)
class Lf2:
    """The library at `n` instants.

    Attributes
    ----------
    i0, i_SF : arrays, shape (n,)
        Nominal envelope and the disturbance by friction per unit of f₁. [A]
    i_PH : array, shape (3, n)
        Modulation by a short of each phase per unit of f₂. [1]
    f1, f2 : arrays
        Polynomial coefficients, lowest power (k¹) first.
    k2_levels, i_BLK : arrays, shape (m,), (m, n)
        Levels of k₂ (the first is 0) and the disturbance by backlash at each. [1, A]
    k6_levels, i_zeta : arrays, shape (m,), (m, n)
        Levels of k₆ and the modulation by eccentricity at each. [1, 1]
    """

    i0: np.ndarray
    i_SF: np.ndarray
    i_PH: np.ndarray
    f1: np.ndarray
    f2: np.ndarray
    k2_levels: np.ndarray
    i_BLK: np.ndarray
    k6_levels: np.ndarray
    i_zeta: np.ndarray

    def at(self, index: np.ndarray) -> Lf2:
        """The same library at some of its instants."""
        return Lf2(
            *(self.i0[index], self.i_SF[index], self.i_PH[:, index], self.f1, self.f2),
            *(self.k2_levels, self.i_BLK[:, index], self.k6_levels, self.i_zeta[:, index]),
        )

    @cached_property
    def _blk(self) -> PchipInterpolator:
        return PchipInterpolator(self.k2_levels, self.i_BLK)

    @cached_property
    def _zeta(self) -> PchipInterpolator:
        return PchipInterpolator(self.k6_levels, self.i_zeta)

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Envelope for fault vectors `k`, shape (..., 6) → (..., n). [A]"""
        k = np.asarray(k, dtype=float)
        k1, k2, k3_5, k6 = k[..., 0], k[..., 1], k[..., 2:5], k[..., 5]
        disturbed = self.i0 + polynomial(self.f1, k1)[..., None] * self.i_SF + self._blk(k2)
        return disturbed * (1.0 + self._zeta(k6) + polynomial(self.f2, k3_5) @ self.i_PH)


def polynomial(coefficients: np.ndarray, x: np.ndarray) -> np.ndarray:
    """c₁ x + c₂ x² + …   (no constant term)"""
    value = np.zeros_like(x)
    for c in coefficients[::-1]:
        value = (value + c) * x
    return value
