"""Runs of a made-up model that scatter otherwise than the builder says, around an error field that nobody knows."""

from __future__ import annotations

import numpy as np
import pytest

from ema.identification.local_noise import local_switching, scales

N, RUNS, SWEEPS = 20, 60, 4
RNG = np.random.default_rng(12)
ROOT = np.tril(RNG.uniform(-0.3, 0.3, (N, N)), -1) + np.diag(RNG.uniform(0.5, 1.5, N))
SWITCHING = ROOT @ ROOT.T
SHAPES = RNG.standard_normal((N, 3))
M = SHAPES @ SHAPES.T
K = 0.2 + 0.02 * RNG.standard_normal((RUNS, 6))


def found(d: np.ndarray, seed: int) -> np.ndarray:
    """Scales d of the instants as found, shape (N,)."""
    rng = np.random.default_rng(seed)
    r = np.sqrt(3.0 * np.sum((K[:, None] - K) ** 2, axis=-1)) / 0.1
    e = np.linalg.cholesky((1.0 + r) * np.exp(-r) + 1e-9 * np.eye(RUNS)) @ rng.standard_normal((RUNS, 3)) @ SHAPES.T
    y = e + rng.standard_normal((RUNS, N)) @ (np.sqrt(d)[:, None] * ROOT).T
    S = SWITCHING
    for _ in range(SWEEPS):
        S = local_switching(K, y, S, SWITCHING, M)
    return np.diag(S) / np.diag(SWITCHING)


def test_runs_that_scatter_as_the_builder_says_change_little():
    d = np.array([found(np.ones(N), seed) for seed in range(6)])
    print(np.mean(d), np.std(np.log(d)))
    assert np.mean(d) == pytest.approx(1.0, abs=0.1)
    assert np.std(np.log(d)) < 0.6 * np.sqrt(2.0 / RUNS)  # far less than each instant's runs alone would say


def test_instants_at_which_runs_scatter_more_or_less_are_told():
    d = np.exp(np.random.default_rng(1).normal(0.0, 1.0, N))
    errors = np.array([np.log(found(d, seed) / d) for seed in range(6)])
    print(errors.mean(), errors.std())
    assert abs(errors.mean()) < 0.15
    assert errors.std() < 2.0 * np.sqrt(2.0 / RUNS)


def test_scales_are_the_mean_of_what_they_may_be():
    rng = np.random.default_rng(3)
    nu, n = 16.0, 30
    d = nu / rng.chisquare(nu, 4000)
    q = d * rng.chisquare(n, 4000)
    assert np.mean(scales(q, n)) == pytest.approx(np.mean(d), rel=0.03)
    assert np.polyfit(scales(q, n), d, 1)[0] == pytest.approx(1.0, abs=0.1)
