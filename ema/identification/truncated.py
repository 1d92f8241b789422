"""A Gaussian estimate under the knowledge that 0 ≤ k ≤ 1: expectation propagation for a normal distribution in a box.

The least-squares estimate without bounds is normal, x ~ N(x̂, C). Its truncation to the box has no closed moments in
six dimensions; EP replaces each pair of bounds by a Gaussian factor that has the same effect on mean and variance [1]_.
Away from the bounds nothing changes and nothing is computed.

References
----------
.. [1] Cunningham, Hennig, Lacoste-Julien, "Gaussian probabilities and expectation propagation", arXiv:1111.6832.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

FAR = 6.0  # standard deviations from which on a bound does not count
_TAIL = 30.0  # in standard deviations; beyond it the normal distribution is out of floating-point numbers
CONVERGED = 1e-5  # change of a factor's precision and mean, in units of the element's own
_SQRT_HALF, _PHI_0 = math.sqrt(0.5), 1.0 / math.sqrt(2.0 * math.pi)


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

    def shortest(self, p: float) -> np.ndarray:
        """Limits of the shortest interval that holds the element with probability `p`, shape (m, 2).

        Near a bound it reaches the bound: a fault that is not there lies within. (An interval with equal tails never
        holds it.)
        """
        a, b = _standard_bounds(self.m, self.s)
        half = ndtri(0.5 + 0.5 * p * (ndtr(b) - ndtr(a)))
        inside, lower = half <= np.minimum(-a, b), self.m < 0.5
        low = np.where(inside, self.m - self.s * half, np.where(lower, 0.0, self.quantile(1.0 - p)))
        high = np.where(inside, self.m + self.s * half, np.where(lower, self.quantile(p), 1.0))
        return np.column_stack([low, high])


def in_unit_box(x: np.ndarray, C: np.ndarray, n_sweeps: int = 30) -> Marginals:
    """Marginals of N(x, C), x (m,), C (m, m), truncated to 0 ≤ k ≤ 1.

    One element's pair of bounds after the other, each a rank-one update; elements that stay far from their bounds get
    no factor and move only by their correlation with those that have one.
    """
    m = len(x)
    mu, S = x.astype(float), C.astype(float)
    tau, nu = [0.0] * m, [0.0] * m
    for _ in range(n_sweeps):
        change = 0.0
        for j in range(m):
            mean_j, s2 = float(mu[j]), float(S[j, j])
            if tau[j] == 0.0 and FAR * math.sqrt(s2) < min(mean_j, 1.0 - mean_j):
                continue
            cavity_s2, cavity_m = _without(mean_j, s2, tau[j], nu[j])
            mean, variance = _moments(cavity_m, math.sqrt(cavity_s2))
            tau_next = max(1.0 / variance - 1.0 / cavity_s2, 0.0)
            d_tau, d_nu = tau_next - tau[j], mean / variance - cavity_m / cavity_s2 - nu[j]
            column = S[:, j].copy()
            mu += column * ((d_nu - d_tau * mean_j) / (1.0 + d_tau * s2))
            S -= (column * (d_tau / (1.0 + d_tau * s2)))[:, None] * column
            tau[j] += d_tau
            nu[j] += d_nu
            change = max(change, abs(d_tau) * s2, abs(d_nu - d_tau * mean_j) * math.sqrt(s2))
        if change < CONVERGED:
            break
    if not any(tau):
        return Marginals(x, np.sqrt(np.diag(C)), x, np.diag(C))
    free = [_without(float(mu[j]), float(S[j, j]), tau[j], nu[j]) for j in range(m)]
    own = [_moments(m_j, math.sqrt(s2)) for s2, m_j in free]
    s2, m_ = np.array(free).T
    return Marginals(m_, np.sqrt(s2), *np.array(own).T)


def _without(mean: float, s2: float, tau: float, nu: float) -> tuple[float, float]:
    """Variance and mean of an element without its own bounds' factor."""
    cavity_s2 = 1.0 / max(1.0 / s2 - tau, 1e-12 / s2)
    return cavity_s2, cavity_s2 * (mean / s2 - nu)


def _standard_bounds(m: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.clip(-m / s, -_TAIL, _TAIL), np.clip((1.0 - m) / s, -_TAIL, _TAIL)


def _upper(z: float) -> float:
    """Probability of a standard normal number above z."""
    return 0.5 * math.erfc(z * _SQRT_HALF)


def _moments(m: float, s: float) -> tuple[float, float]:
    """Mean and variance of N(m, s²) truncated to 0…1."""
    a, b = max(min(-m / s, _TAIL), -_TAIL), max(min((1.0 - m) / s, _TAIL), -_TAIL)
    Z = max(_upper(a) - _upper(b) if a > 0 else _upper(-b) - _upper(-a), 1e-200)
    phi_a, phi_b = (math.exp(-0.5 * z * z) * _PHI_0 for z in (a, b))
    shift = (phi_a - phi_b) / Z
    variance = s * s * min(max(1.0 + (a * phi_a - b * phi_b) / Z - shift * shift, 1e-4), 1.0)
    return min(max(m + s * shift, 0.0), 1.0), variance
