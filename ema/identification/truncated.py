"""A Gaussian estimate under the knowledge that 0 ≤ k ≤ 1: expectation propagation for a normal distribution in a box.

The least-squares estimate without bounds is normal, x ~ N(x̂, C). Its truncation to the box has no closed moments in
six dimensions; EP replaces each pair of bounds by a Gaussian factor that has the same effect on mean and variance [1]_.
Away from the bounds nothing changes and nothing is computed.

References
----------
.. [1] Cunningham, Hennig, Lacoste-Julien, "Gaussian probabilities and expectation propagation", arXiv:1111.6832.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

FAR = 6.0  # standard deviations from which on a bound does not count
_TAIL = 30.0  # in standard deviations; beyond it the normal distribution is out of floating-point numbers


class Marginals(NamedTuple):
    """Each element's distribution: a normal one (`m`, `s`), truncated to 0…1; `mean` and `variance` after that."""

    m: np.ndarray
    s: np.ndarray
    mean: np.ndarray
    variance: np.ndarray

    def quantile(self, p: float) -> np.ndarray:
        """Value below which the element lies with probability `p`, shape (6,)."""
        a, b = _standard_bounds(self.m, self.s)
        mirrored = a > 0  # the upper tail has more digits than the lower
        low, high, q = np.where(mirrored, -b, a), np.where(mirrored, -a, b), np.where(mirrored, 1.0 - p, p)
        z = ndtri(np.maximum(ndtr(low) + q * (ndtr(high) - ndtr(low)), 1e-300))
        return np.clip(self.m + self.s * np.where(mirrored, -z, z), 0.0, 1.0)


def in_unit_box(x: np.ndarray, C: np.ndarray, n_sweeps: int = 30) -> Marginals:
    """Marginals of N(x, C), x (6,), C (6, 6), truncated to 0 ≤ k ≤ 1."""
    sd = np.sqrt(np.diag(C))
    if (x > FAR * sd).all() and (1.0 - x > FAR * sd).all():
        return Marginals(x, sd, x, sd**2)
    precision = np.linalg.inv(C)
    tau, nu = np.zeros(len(x)), np.zeros(len(x))
    for _ in range(n_sweeps):
        S = np.linalg.inv(precision + np.diag(tau))
        mu = S @ (precision @ x + nu)
        s2 = np.diag(S)
        cavity_s2 = 1.0 / np.maximum(1.0 / s2 - tau, 1e-12 / s2)
        cavity_m = cavity_s2 * (mu / s2 - nu)
        mean, variance = _moments(cavity_m, np.sqrt(cavity_s2))
        tau_next = np.maximum(1.0 / variance - 1.0 / cavity_s2, 0.0)
        nu_next = mean / variance - cavity_m / cavity_s2
        change = np.max(np.abs(tau_next - tau) * s2)
        tau, nu = 0.5 * (tau + tau_next), 0.5 * (nu + nu_next)  # damped: all sites are updated at once
        if change < 1e-4:
            break
    return Marginals(cavity_m, np.sqrt(cavity_s2), mean, variance)


def _standard_bounds(m: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.clip(-m / s, -_TAIL, _TAIL), np.clip((1.0 - m) / s, -_TAIL, _TAIL)


def _moments(m: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of N(m, s²) truncated to 0…1."""
    a, b = _standard_bounds(m, s)
    Z = np.maximum(np.where(a > 0, ndtr(-a) - ndtr(-b), ndtr(b) - ndtr(a)), 1e-200)
    phi_a, phi_b = (np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) for z in (a, b))
    shift = (phi_a - phi_b) / Z
    variance = s**2 * np.clip(1.0 + (a * phi_a - b * phi_b) / Z - shift**2, 1e-4, 1.0)
    return np.clip(m + s * shift, 0.0, 1.0), variance
