"""Proper orthogonal decomposition of the snapshots (section 3.1 of the paper), in blocks: memory stays bounded."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import eigh

BLOCK = 512  # snapshots looked at together


class Rows(Protocol):
    """Snapshots as rows, of which a slice is an array: an array itself, or a file of them."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(n_s, n_times)."""

    def __getitem__(self, rows: slice, /) -> np.ndarray: ...


class Pod(NamedTuple):
    """Modes `v` (n_times, r), orthonormal; eigenvalues `lam` (r,) with their share of the whole, `share` (r,)."""

    v: np.ndarray
    lam: np.ndarray
    share: np.ndarray


def pod(snapshots: Rows, i0: np.ndarray, r: int = 10, seed: int = 0) -> Pod:
    """First `r` modes of i(k) - i₀ by randomised SVD with power iterations, reading the snapshots block by block.

    Parameters
    ----------
    snapshots : Rows, shape (n_s, n_times)
        One envelope per row. [A]
    i0 : array, shape (n_times,)
        Reference signal in nominal condition. [A]

    Notes
    -----
    The sign of each mode is fixed so that its largest component is positive.

    References
    ----------
    .. [1] Halko, Martinsson, Tropp, "Finding structure with randomness", SIAM Review 53 (2011), algorithm 4.4.
    """
    n_s, n_times = snapshots.shape
    r = min(r, n_s, n_times)
    width = min(r + 10, n_s, n_times)
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((n_times, width)))[0]
    G, total = _gram_times(snapshots, i0, Q)
    for _ in range(4):
        Q = np.linalg.qr(G)[0]
        G, total = _gram_times(snapshots, i0, Q)
    lam, w = eigh(Q.T @ G)
    order = np.argsort(lam)[::-1][:r]
    v = Q @ w[:, order]
    v *= np.sign(v[np.abs(v).argmax(axis=0), np.arange(v.shape[1])])
    lam = np.maximum(lam[order], 0.0)
    return Pod(v=v, lam=lam, share=lam / max(total, np.finfo(float).tiny))


def _gram_times(snapshots: Rows, i0: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, float]:
    """(XᵀX) Q and the trace of XᵀX for X = snapshots - i₀, in one pass."""
    G = np.zeros_like(Q)
    total = 0.0
    for first in range(0, snapshots.shape[0], BLOCK):
        X = np.asarray(snapshots[first : first + BLOCK], dtype=float) - i0
        G += X.T @ (X @ Q)
        total += float(np.einsum("ij,ij->", X, X))
    return G, total
