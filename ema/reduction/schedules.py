"""Sampling schedules: the instants at which the envelope is kept. One interface, so that they can be compared.

Every schedule takes what the offline phase knows (`Knowledge`) and returns `n` increasing sample indices.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from ema.core.errors import ConfigError


class Knowledge(NamedTuple):
    """What a schedule may use: first POD mode (n_t,), Jacobian (n_t, 6), envelopes without faults (n, n_t)."""

    t: np.ndarray
    v1: np.ndarray
    A: np.ndarray
    nominal: np.ndarray

    def covariance(self, at: np.ndarray) -> np.ndarray:
        """Covariance of the switching noise at some instants only: over a whole cycle it fills 200 MB."""
        return np.cov(self.nominal[:, at], rowvar=False)


def som(know: Knowledge, n: int, seed: int) -> np.ndarray:
    """The paper's: a chain of n neurons trained on T = [v₁, t]; their time components are the sampling times.

    Both components are scaled to unit range. Inverse decay of learning rate and radius: the default decay leaves the
    map a fifth coarser (mean distance of the data from their neuron).
    """
    neurons = _train(know, n, seed)
    index = np.searchsorted(know.t, np.sort(neurons[:, 1]) * know.t[-1])
    return _distinct(index, len(know.t))


def uniform(know: Knowledge, n: int, seed: int) -> np.ndarray:
    """Equal distances in time."""
    n_times = len(know.t)
    return _distinct(np.round((np.arange(n) + 0.5) * n_times / n).astype(int), n_times)


def qr_pivot(know: Knowledge, n: int, seed: int) -> np.ndarray:
    """Pivots of a QR factorisation of the Jacobian's rows, six at a time over the rows left (near D-optimal)."""
    left = np.arange(len(know.t))
    chosen: list[int] = []
    while len(chosen) < n:
        pivots = qr(know.A[left].T, mode="r", pivoting=True)[1][: min(know.A.shape[1], n - len(chosen))]
        chosen.extend(left[pivots])
        left = np.delete(left, pivots)
    return np.sort(np.array(chosen))


def greedy(know: Knowledge, n: int, seed: int) -> np.ndarray:
    """Add, from a grid, the instant that raises log det(Aᵀ Σ⁻¹ A) most; Σ is the switching-noise covariance."""
    grid = np.arange(5, len(know.t), 10)
    A, S = know.A[grid], know.covariance(grid)
    information = np.eye(A.shape[1]) * 1e-6 * np.sum(A**2) / np.mean(np.diag(S))
    conditional = np.diag(S).copy()  # variance of each candidate given the chosen
    gain = A.copy()  # Jacobian of each candidate given the chosen
    factor = np.zeros((len(grid), 0))
    chosen: list[int] = []
    for _ in range(min(n, len(grid))):
        score = np.einsum("ij,ji->i", gain, np.linalg.solve(information, gain.T)) / conditional
        score[chosen] = -np.inf
        best = int(np.argmax(score))
        chosen.append(best)
        information += np.outer(gain[best], gain[best]) / conditional[best]
        column = (S[:, best] - factor @ factor[best]) / np.sqrt(conditional[best])
        gain = gain - np.outer(column, gain[best]) / np.sqrt(conditional[best])
        conditional = np.maximum(conditional - column**2, 1e-3 * np.diag(S))
        factor = np.column_stack([factor, column])
    return np.sort(grid[chosen])


SCHEDULES: dict[str, Callable[[Knowledge, int, int], np.ndarray]] = {
    "som": som,
    "uniform": uniform,
    "qr": qr_pivot,
    "greedy": greedy,
}


def schedule(name: str, know: Knowledge, n: int, seed: int) -> np.ndarray:
    """Sample indices of the schedule `name`, shape (n,), increasing."""
    if name not in SCHEDULES:
        raise ConfigError(f"schedule '{name}' is unknown; known: {', '.join(SCHEDULES)}")
    return SCHEDULES[name](know, n, seed)


def _scaled(know: Knowledge) -> np.ndarray:
    v1 = (know.v1 - know.v1.min()) / max(np.ptp(know.v1), np.finfo(float).tiny)
    return np.column_stack([v1, know.t / know.t[-1]])


def _train(know: Knowledge, n: int, seed: int) -> np.ndarray:
    from minisom import MiniSom  # here: online nobody trains a map

    data = _scaled(know)
    net = MiniSom(1, n, 2, sigma=n / 4, learning_rate=0.5, decay_function="inverse_decay_to_zero",
                  sigma_decay_function="inverse_decay_to_one", random_seed=seed)  # fmt: skip
    start = np.column_stack([np.interp(np.linspace(0, 1, n), data[:, 1], data[:, 0]), np.linspace(0, 1, n)])
    net._weights[0] = start
    net.train(data, 20_000, random_order=True)
    return np.asarray(net.get_weights()[0])


def _distinct(index: np.ndarray, n_times: int) -> np.ndarray:
    """Increasing indices within 0…n_times-1, doubles moved to the next free place."""
    index = np.clip(np.sort(index), 0, n_times - 1)
    for j in range(1, len(index)):
        index[j] = max(index[j], index[j - 1] + 1)
    for j in range(len(index) - 1, -1, -1):
        index[j] = min(index[j], n_times - len(index) + j)
    return index
