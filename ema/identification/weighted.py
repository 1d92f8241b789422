"""Bounded, weighted least squares of a linearised problem: the one step all identifiers share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import (
    dgeqrf,
    dpotrf,
    dtrtrs,
)  # bare: on thirty equations scipy's wrappers cost more than the work
from scipy.optimize import lsq_linear, nnls
from scipy.special import chdtrc


class Whitener:
    """Weights residuals by a covariance Σ = L Lᵀ:   w = L⁻¹ r has unit covariance."""

    def __init__(self, covariance: np.ndarray):
        self.L, failed = dpotrf(covariance, lower=1, clean=1)
        if failed:
            raise np.linalg.LinAlgError("a noise covariance is not positive definite")

    def __call__(self, x: np.ndarray, transposed: bool = False) -> np.ndarray:
        """L⁻¹ x, or L⁻ᵀ x, for x of shape (n,) or (n, m)."""
        return np.asarray(dtrtrs(self.L, x, lower=1, trans=int(transposed))[0])


class Solution(NamedTuple):
    """Minimiser `x` (m,) of ‖b - A x‖² within bounds, `free` (m,) without, and its covariance (AᵀA)⁻¹ (m, m)."""

    x: np.ndarray
    free: np.ndarray
    covariance: np.ndarray


def bounded_least_squares(A: np.ndarray, b: np.ndarray, low: np.ndarray, high: np.ndarray) -> Solution:
    """Minimise ‖b - A x‖² for low ≤ x ≤ high by QR; A (n, m) and b (n,) already whitened."""
    m = A.shape[1]
    triangle = np.triu(dgeqrf(np.column_stack([A, b]))[0][:m])  # of [A b] = Q [R c; 0 ρ]: Qᵀb comes with it
    R, c = triangle[:, :m], triangle[:, m]
    R_inverse = dtrtrs(R + np.diag(np.where(np.diag(R) == 0, 1e-12, 0.0)), np.eye(m))[0]
    x = free = R_inverse @ c
    if (x < low).any() or (x > high).any():
        x = low + nnls(R, c - R @ low)[0]
        if (x > high).any():
            x = lsq_linear(R, c, bounds=(low, high), method="bvls").x
    return Solution(np.clip(x, low, high), free, R_inverse @ R_inverse.T)


def p_value(chi2: float, dof: int) -> float:
    """Probability that a χ² variable of `dof` degrees of freedom exceeds `chi2`."""
    return float(chdtrc(dof, chi2)) if dof > 0 else 1.0
