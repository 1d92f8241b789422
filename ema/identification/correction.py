"""A smooth model made right near one point by a few runs of a noisy one.

The noisy model's runs differ from the smooth model by its error e(k) and by switching. e is taken for a Gaussian
process with the covariance M that the builder measured for the smooth model's error, times some s in each of M's
principal directions, and with a correlation that falls with distance:

    y_n = e(k_n) + noise,   cov e = s M ρ,   ρ(k, k') = (1 + r) exp(-r),   r = √3 ‖k - k'‖ / ℓ,   cov noise = Σ_switch

so that every run made so far counts, each as far as it is near; where M is far below Σ_switch the runs change nothing.
Sticking, reversals and the ends of the play come at other instants with other faults, so e has kinks: ρ is Matérn's
with ν = 3/2, once differentiable. How far e reaches (ℓ) and how large it is here (s) differs from one k to the next by
more than any table could say; the runs tell by their marginal likelihood, and over what they leave open is averaged. In
coordinates in which both Σ_switch and M are diagonal, this is one scalar process for each [1]_.

References
----------
.. [1] Rasmussen, Williams, "Gaussian Processes for Machine Learning", MIT Press, 2006, chapters 2, 4.2.1 and 5.4.1.
"""

from __future__ import annotations

from itertools import compress
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, softmax

LENGTHS = 0.02 * 2.0 ** np.arange(6)  # ℓ that are compared, 0.02 … 0.64
SCALES = 4.0 ** np.arange(-2.0, 2.5, 1.0)  # s that are compared, 1/16 … 16
NEGLIGIBLE = 1e-3  # probability of an ℓ, relative to the likeliest, below which it is left out


class _Process(NamedTuple):
    """e given one ℓ, seen in coordinates in which it and the noise are independent.

    `V` (n, n): eigenvectors of ρ, η its eigenvalues; `c` (n, n_omega): the runs in them; `lam` (n_scales, n_omega):
    variance of e for each s; `share` (n_scales, n_omega): how probable this ℓ and each s are; `gain` (n_scales, n,
    n_omega): λ/(1 + λ η).
    """

    length: float
    V: np.ndarray
    c: np.ndarray
    lam: np.ndarray
    share: np.ndarray
    gain: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """Of the runs in the mean of e, averaged over s, shape (n, n_omega)."""
        return np.asarray(self.V @ (np.einsum("so,sno->no", self.share, self.gain) * self.c))


class Correction:
    """Posterior of the smooth model's error given runs, averaged over what ℓ and s may be.

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
        self._processes = self._probable(np.linalg.solve(self._back, y.T).T, np.maximum(lam, 0.0))
        self._weights = [p.weights for p in self._processes]

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Mean of e at points `k` (m, d), shape (m, n_omega). [A]"""
        return np.asarray(self._mean(k) @ self._back.T)

    def covariance(self, k: np.ndarray) -> np.ndarray:
        """Covariance of e that the runs leave, the mean of that at points `k` (m, d), shape (n_omega, n_omega). [A²]

        How far they leave e open if ℓ and s were known, and how far its mean depends on ℓ and s.
        """
        mean, left = self._mean(k), np.zeros(len(self._back))
        for p in self._processes:
            R = self._rho(k, p.length) @ p.V
            open_ = p.lam[:, None] * np.maximum(1.0 - np.einsum("mn,sno->smo", R**2, p.gain), 0.0)
            apart = np.einsum("mn,sno->smo", R, p.gain * p.c) - mean
            left += np.sum(p.share * np.mean(open_ + apart**2, axis=1), axis=0)
        return np.asarray((self._back * left) @ self._back.T)

    def _mean(self, k: np.ndarray) -> np.ndarray:
        parts = [self._rho(k, p.length) @ w for p, w in zip(self._processes, self._weights, strict=True)]
        return np.asarray(np.sum(parts, axis=0))

    def _probable(self, z: np.ndarray, lam: np.ndarray) -> list[_Process]:
        """For each ℓ that runs `z` (n, n_omega), in units of their noise, leave possible."""
        found, evidence, scaled = [], [], SCALES[:, None] * lam
        for length in LENGTHS:
            eta, V = np.linalg.eigh(self._rho(self._k, length))
            c, variance = V.T @ z, 1.0 + scaled[:, None] * np.maximum(eta, 0.0)[:, None]
            log_p = -0.5 * np.sum(np.log(variance) + c**2 / variance, axis=1)
            of_each = logsumexp(log_p, axis=0)  # all s are as probable beforehand, and all ℓ
            evidence.append(float(of_each.sum()))
            found.append(_Process(length, V, c, scaled, np.exp(log_p - of_each), scaled[:, None] / variance))
        probability = softmax(evidence)
        kept = probability > NEGLIGIBLE * probability.max()
        pairs = zip(compress(found, kept), probability[kept] / probability[kept].sum(), strict=True)
        return [p._replace(share=share * p.share) for p, share in pairs]

    def _rho(self, k: np.ndarray, length: float) -> np.ndarray:
        """Correlation of points `k` (m, d) with the runs' points, shape (m, n)."""
        r = np.sqrt(3.0 * np.sum((k[:, None] - self._k) ** 2, axis=-1)) / length
        return np.asarray((1.0 + r) * np.exp(-r))
