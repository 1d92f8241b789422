"""A smooth model made right near one point by a few runs of a noisy one.

The noisy model's runs differ from the smooth model by its error e(k) and by switching. e is taken for a Gaussian
process with the covariance M that the builder measured for the smooth model's error, and a correlation that falls with
distance:

    y_n = e(k_n) + noise,   cov e = M ρ,   ρ(k, k') = exp(-‖k - k'‖² / 2ℓ²),   cov noise = Σ_switch

so that every run made so far counts, each as far as it is near; where M is far below Σ_switch the runs change nothing.
In coordinates in which both Σ_switch and M are diagonal, this is one scalar process for each [1]_.

References
----------
.. [1] Rasmussen, Williams, "Gaussian Processes for Machine Learning", MIT Press, 2006, chapter 2.
"""

from __future__ import annotations

import numpy as np


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
    length : float
        Correlation length ℓ. [1]
    """

    def __init__(self, k: np.ndarray, y: np.ndarray, switching: np.ndarray, M: np.ndarray, length: float):
        L = np.linalg.cholesky(switching)
        lam, U = np.linalg.eigh(np.linalg.solve(L, np.linalg.solve(L, M).T))
        self._k, self._length = k, length
        self._lam, self._back = np.maximum(lam, 0.0), L @ U
        z = np.linalg.solve(self._back, y.T).T
        self._eta, self._V = np.linalg.eigh(self._rho(k))
        self._gain = self._lam / (1.0 + self._lam * np.maximum(self._eta, 0.0)[:, None])  # (n, n_omega)
        self._weights = self._V @ (self._gain * (self._V.T @ z))

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Mean of e at points `k` (m, d), shape (m, n_omega). [A]"""
        return np.asarray(self._rho(k) @ self._weights @ self._back.T)

    def covariance(self, k: np.ndarray) -> np.ndarray:
        """Covariance of e at `k` (d,) that the runs leave, shape (n_omega, n_omega). [A²]"""
        known = (self._rho(k[None])[0] @ self._V) ** 2
        left = self._lam * np.maximum(1.0 - known @ self._gain, 0.0)
        return np.asarray((self._back * left) @ self._back.T)

    def _rho(self, k: np.ndarray) -> np.ndarray:
        """Correlation of points `k` (m, d) with the runs' points, shape (m, n)."""
        return np.asarray(np.exp(-0.5 * np.sum((k[:, None] - self._k) ** 2, axis=-1) / self._length**2))
