"""A smooth model made right near one point by a few runs of a noisy one.

The noisy model's runs differ from the smooth model by its error e(k) and by switching. e is taken for a Gaussian
process with the covariance M that the builder measured for the smooth model's error, times some s in each of M's
principal directions, and with a correlation that falls with distance:

    y_n = e(k_n) + noise,   cov e = s M ρ,   ρ(k, k') = (1 + r) exp(-r),   r = √3 ‖k - k'‖ / ℓ,   cov noise = Σ_switch

so that every run made so far counts, each as far as it is near; where M is far below Σ_switch the runs change nothing.
Sticking, reversals and the ends of the play come at other instants with other faults, so e has kinks: ρ is Matérn's
with ν = 3/2, once differentiable. How far e reaches (ℓ) and how large it is here (s) differs from one k to the next by
more than any table could say, and from one direction to the next; the runs tell by their marginal likelihood, and over
what they leave open is averaged. In coordinates in which both Σ_switch and M are diagonal, this is one scalar process
for each [1]_, with ℓ and s of its own, of a distribution that all have in common.

References
----------
.. [1] Rasmussen, Williams, "Gaussian Processes for Machine Learning", MIT Press, 2006, chapters 2, 4.2.1 and 5.4.1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import softmax

LENGTHS = 0.02 * 2.0 ** np.arange(6)  # ℓ that are compared, 0.02 … 0.64
SCALES = 4.0 ** np.arange(-2.0, 2.5, 1.0)  # s that are compared, 1/16 … 16
N_SWEEPS = 10  # in which directions tell each other what ℓ and s are usual


class _Process(NamedTuple):
    """e given one ℓ, seen in coordinates in which it and the noise are independent.

    `V` (n, n): eigenvectors of ρ, η its eigenvalues; `c` (n, n_omega): the runs in them; `lam` (n_scales, n_omega):
    variance of e for each s; `share` (n_scales, n_omega): how probable this ℓ with each s is; `gain` (n_scales, n,
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
        self._k, self._y, self._back = k, y, L @ U
        self._processes = self._probable(np.linalg.solve(self._back, y.T).T, np.maximum(lam, 0.0))
        self._weights = [p.weights for p in self._processes]

    def __call__(self, k: np.ndarray) -> np.ndarray:
        """Mean of e at points `k` (m, d), shape (m, n_omega). [A]"""
        return np.asarray(self._mean(k) @ self._back.T)

    def covariance(self, k: np.ndarray) -> np.ndarray:
        """Covariance of e that the runs leave, the mean of that at points `k` (m, d), shape (n_omega, n_omega). [A²]

        How far they leave e open if ℓ and s were known, and how far its mean depends on ℓ and s.
        """
        return np.asarray((self._back * self._left_open(k).mean(axis=0)) @ self._back.T)

    def squared_noise(self) -> np.ndarray:
        """Square of the noise of each run, as expected now, shape (n, n_omega). [A²]"""
        noise = self._y - self(self._k)
        return np.asarray(noise**2 + self._left_open(self._k) @ (self._back**2).T)

    def _left_open(self, k: np.ndarray) -> np.ndarray:
        """Variance of e in each coordinate, at each point, shape (m, n_omega)."""
        mean = self._mean(k)
        left = np.zeros_like(mean)
        for p in self._processes:
            R = self._rho(k, p.length) @ p.V
            open_ = p.lam[:, None] * np.maximum(1.0 - R**2 @ p.gain, 0.0)
            left += np.sum(p.share[:, None] * (open_ + (R @ (p.gain * p.c) - mean) ** 2), axis=0)
        return left

    def _mean(self, k: np.ndarray) -> np.ndarray:
        parts = [self._rho(k, p.length) @ w for p, w in zip(self._processes, self._weights, strict=True)]
        return np.asarray(np.sum(parts, axis=0))

    def _probable(self, z: np.ndarray, lam: np.ndarray) -> list[_Process]:
        """For each ℓ, seen in runs `z` (n, n_omega), in units of their noise."""
        found, evidence, scaled = [], [], SCALES[:, None] * lam
        for length in LENGTHS:
            eta, V = np.linalg.eigh(self._rho(self._k, length))
            c, variance = V.T @ z, 1.0 + scaled[:, None] * np.maximum(eta, 0.0)[:, None]
            evidence.append(-0.5 * np.sum(np.log(variance) + c**2 / variance, axis=1))
            found.append(_Process(length, V, c, scaled, evidence[-1], scaled[:, None] / variance))
        shares = _shares(np.array(evidence))
        return [p._replace(share=share) for p, share in zip(found, shares, strict=True)]

    def _rho(self, k: np.ndarray, length: float) -> np.ndarray:
        """Correlation of points `k` (m, d) with the runs' points, shape (m, n)."""
        r = np.sqrt(3.0 * np.sum((k[:, None] - self._k) ** 2, axis=-1)) / length
        return np.asarray((1.0 + r) * np.exp(-r))


def _shares(evidence: np.ndarray) -> np.ndarray:
    """How probable each ℓ and s is in each direction, shape of `evidence` (n_lengths, n_scales, n_omega), its log.

    Directions differ, but not without measure: beforehand ℓ and s are distributed in all alike, as all together say.
    Their distribution is found by expectation maximisation; it has the weight of one direction where it is uniform.
    """
    n_cells, n_omega = evidence[..., 0].size, evidence.shape[-1]
    prior = np.full(evidence.shape[:2], 1.0 / n_cells)
    for _ in range(N_SWEEPS):
        shares = softmax(evidence + np.log(prior)[..., None], axis=(0, 1))
        prior = (shares.sum(axis=-1) + 1.0 / n_cells) / (n_omega + 1.0)
    return np.asarray(shares)
