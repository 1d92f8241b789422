"""A made-up error field, seen through noise. How far it reaches and how large it is, nobody says."""

from __future__ import annotations

import numpy as np
import pytest

from ema.identification.correction import Correction

N, RUNS = 8, 48
RNG = np.random.default_rng(4)
SWITCHING = np.diag(RNG.uniform(0.5, 2.0, N))
SHAPES = RNG.standard_normal((N, 3))
M = SHAPES @ SHAPES.T
K = 0.2 + 0.02 * RNG.standard_normal((RUNS, 6))


def drawn(at: np.ndarray, length: float, scale: float, rng: np.random.Generator) -> np.ndarray:
    """A field with covariance s M ρ at points (m, 6), shape (m, N)."""
    r = np.sqrt(3.0 * np.sum((at[:, None] - at) ** 2, axis=-1)) / length
    rho = (1.0 + r) * np.exp(-r) + 1e-9 * np.eye(len(at))
    return np.sqrt(scale) * np.linalg.cholesky(rho) @ rng.standard_normal((len(at), 3)) @ SHAPES.T


def seen(e: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The field through switching noise."""
    return e + rng.standard_normal(e.shape) * np.sqrt(np.diag(SWITCHING))


@pytest.mark.parametrize("length", [0.05, 0.3])
@pytest.mark.parametrize("scale", [0.3, 3.0])
def test_what_is_left_open_is_what_is_missed(length, scale):
    at = np.full((1, 6), 0.21)
    missed, left = [], []
    for seed in range(120):
        rng = np.random.default_rng(seed)
        e = drawn(np.vstack([K, at]), length, scale, rng)
        c = Correction(K, seen(e[:-1], rng), SWITCHING, M)
        missed.append(e[-1] - c(at)[0])
        left.append(c.covariance(at))
    found = np.cov(np.array(missed).T)
    assert np.trace(found) < 0.5 * scale * np.trace(M)
    assert np.trace(np.mean(left, axis=0)) == pytest.approx(np.trace(found), rel=0.25)


def test_where_a_field_is_rougher_more_is_left_open():
    at = K[:4] + 0.02
    smooth, rough = (
        Correction(K, seen(drawn(K, length, 1.0, np.random.default_rng(1)), np.random.default_rng(2)), SWITCHING, M)
        for length in (0.5, 0.05)
    )
    assert np.trace(rough.covariance(at)) > 2.0 * np.trace(smooth.covariance(at))


def test_far_from_all_runs_nothing_is_known():
    rng = np.random.default_rng(3)
    c = Correction(K, seen(drawn(K, 0.05, 1.0, rng), rng), SWITCHING, M)
    far = np.full((1, 6), 0.9)
    assert np.allclose(c(far), 0.0, atol=1e-3)
    assert np.trace(c.covariance(far)) > 3.0 * np.trace(c.covariance(K + 0.005))


def test_a_model_that_does_not_err_is_left_alone():
    c = Correction(K, RNG.standard_normal((RUNS, N)), SWITCHING, 0.0 * M)
    assert np.allclose(c(K), 0.0)
    assert np.allclose(c.covariance(K), 0.0)
