"""A smooth model made right near one point by a few runs of a noisy one.

The noisy model's runs differ from the smooth model by its error e(k) and by switching. e is taken for a Gaussian
process with the covariance M that the builder measured for the smooth model's error, times some s in each of M's
principal directions, and with a correlation that falls with distance:

    y_n = e(k_n) + noise,   cov e = s M ρ,   ρ(k, k') = (1 + r) exp(-r),   r = √3 ‖k - k'‖ / ℓ,   cov noise = Σ_switch

so that every run made so far counts, each as far as it is near; where M is far below Σ_switch the runs change nothing.
Sticking, reversals and the ends of the play come at other instants with other faults, so e has kinks: ρ is Matérn's
with ν = 3/2, once differentiable. How far e reaches (ℓ) and how large it is here (s) differs from one k to the next by
more than any table could say; the runs themselves tell, by their marginal likelihood. In coordinates in which both
Σ_switch and M are diagonal, this is one scalar process for each [1]_.

References
----------
.. [1] Rasmussen, Williams, "Gaussian Processes for Machine Learning", MIT Press, 2006, chapters 2, 4.2.1 and 5.4.1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

LENGTHS = 0.02 * 2.0 ** np.arange(6)  # ℓ that are compared, 0.02 … 0.64
SCALES = 4.0 ** np.arange(-2.0, 2.5, 1.0)  # s that are compared, 1/16 … 16


class _Process(NamedTuple):
    """e given one ℓ, seen in coordinates in which it and the noise are independent; s averaged by its probability.

    `eta` (n,), `V` (n, n): eigenvalues and vectors of ρ; `lam` (n_scales, n_omega): variance of e for each s;
    `share` (n_scales, n_omega): how probable each s is; `gain` (n_scales, n, n_omega): λ/(1 + λ η).
    """

    length: float
    eta: np.ndarray
    V: np.ndarray
    lam: np.ndarray
    share: np.ndarray
    gain: np.ndarray


class Correction:
    """Posterior of the smooth model's error given runs.

    Parameters
    ----------
    k : array, shape (n, d)
        Points of the runs.
    y : array, shape (n, n_omega)
        Noisy less smooth model there. [A]
    switching, M : arrays, shape (n_omega, n_omega)
        Covariance of one run, and of e before any run. [A²]
    """

    def __init__(self, k: np.ndarray, y: np.ndarray, switching: np.ndarray, M: np.ndarray):
        L = np.linalg.cholesky(switching)
        lam, U = np.linalg.eigh(np.linalg.solve(L, np.linalg.solve(L, M).T))
        self._k, self._back = k, L @ U
        z = np.linalg.solve(self._back, y.T).T
        self._process = p = self._likeliest(z, np.maximum(lam, 0.0))
        self._weights = p.V @ (np.einsum("so,sno->no", p.share, p.gain) * (p.V.T @ z))

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Mean of e at points `k` (m, d), shape (m, n_omega). [A]"""
        return np.asarray(self._rho(k, self._process.length) @ self._weights @ self._back.T)

    def covariance(self, k: np.ndarray) -> np.ndarray:
        """Covariance of e that the runs leave, the mean of that at points `k` (m, d), shape (n_omega, n_omega). [A²]"""
        p = self._process
        known = np.mean((self._rho(k, p.length) @ p.V) ** 2, axis=0)
        left = np.sum(p.share * p.lam * np.maximum(1.0 - np.einsum("n,sno->so", known, p.gain), 0.0), axis=0)
        return np.asarray((self._back * left) @ self._back.T)

    def _likeliest(self, z: np.ndarray, lam: np.ndarray) -> _Process:
        """The ℓ under which runs `z` (n, n_omega), in units of their noise, are most likely, whatever s is."""
        found, scaled = [], SCALES[:, None] * lam
        for length in LENGTHS:
            eta, V = np.linalg.eigh(self._rho(self._k, length))
            variance = 1.0 + scaled[:, None, :] * np.maximum(eta, 0.0)[:, None]
            log_p = -0.5 * np.sum(np.log(variance) + (V.T @ z) ** 2 / variance, axis=1)
            evidence = logsumexp(log_p, axis=0)
            share, gain = np.exp(log_p - evidence), scaled[:, None, :] / variance
            found.append((float(evidence.sum()), _Process(length, eta, V, scaled, share, gain)))
        return max(found, key=lambda pair: pair[0])[1]

    def _rho(self, k: np.ndarray, length: float) -> np.ndarray:
        """Correlation of points `k` (m, d) with the runs' points, shape (m, n)."""
        r = np.sqrt(3.0 * np.sum((k[:, None] - self._k) ** 2, axis=-1)) / length
        return np.asarray((1.0 + r) * np.exp(-r))
