"""A made-up error field, seen through noise."""

from __future__ import annotations

import numpy as np

from ema.identification.correction import Correction

N, RUNS, LENGTH = 8, 64, 0.3
RNG = np.random.default_rng(4)
SWITCHING = np.diag(RNG.uniform(0.5, 2.0, N))
SHAPES = RNG.standard_normal((N, 3))
M = SHAPES @ SHAPES.T
K = 0.2 + 0.04 * RNG.standard_normal((RUNS, 6))


def drawn(at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A field with covariance M ρ at points (m, 6), shape (m, N)."""
    rho = np.exp(-0.5 * np.sum((at[:, None] - at) ** 2, axis=-1) / LENGTH**2) + 1e-9 * np.eye(len(at))
    return np.linalg.cholesky(rho) @ rng.standard_normal((len(at), 3)) @ SHAPES.T


def test_what_is_left_open_is_what_is_missed():
    at = np.full((1, 6), 0.22)
    missed, left = [], None
    for seed in range(300):
        rng = np.random.default_rng(seed)
        e = drawn(np.vstack([K, at]), rng)
        noisy = e[:-1] + rng.standard_normal((RUNS, N)) * np.sqrt(np.diag(SWITCHING))
        c = Correction(K, noisy, SWITCHING, M, LENGTH)
        missed.append(e[-1] - c(at)[0])
        left = c.covariance(at[0])
    found = np.cov(np.array(missed).T)
    assert np.trace(found) < 0.1 * np.trace(M)
    assert np.allclose(np.diag(found), np.diag(left), rtol=0.35)


def test_far_from_all_runs_nothing_is_known():
    c = Correction(K, RNG.standard_normal((RUNS, N)), SWITCHING, M, 0.05)
    far = np.full(6, 0.9)
    assert np.allclose(c(far[None]), 0.0, atol=1e-9)
    assert np.allclose(c.covariance(far), M)


def test_a_model_that_does_not_err_is_left_alone():
    c = Correction(K, RNG.standard_normal((RUNS, N)), SWITCHING, 0.0 * M, LENGTH)
    assert np.allclose(c(K), 0.0)
    assert np.allclose(c.covariance(K[0]), 0.0)
