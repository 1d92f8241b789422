"""The truncated Gaussian against brute-force sampling."""

from __future__ import annotations

import numpy as np
import pytest

from ema.identification.truncated import in_unit_box


def correlated(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    B = rng.standard_normal((6, 6))
    d = np.diag(rng.uniform(0.005, 0.03, 6))
    S = B @ B.T + 6.0 * np.eye(6)
    s = np.sqrt(np.diag(S))
    return d @ (S / np.outer(s, s)) @ d


@pytest.mark.parametrize("seed", range(4))
def test_moments_and_quantiles_are_those_of_samples_within_the_box(seed):
    rng = np.random.default_rng(seed)
    C = correlated(seed)
    x = np.where(rng.random(6) < 0.5, rng.uniform(-0.01, 0.02, 6), rng.uniform(0.1, 0.9, 6))
    samples = rng.multivariate_normal(x, C, 400_000)
    samples = samples[((samples >= 0) & (samples <= 1)).all(axis=1)]
    assert len(samples) > 1000
    m = in_unit_box(x, C)
    sd = samples.std(axis=0)
    assert np.abs(m.mean - samples.mean(axis=0)).max() < 0.1 * sd.max()
    assert np.allclose(np.sqrt(m.variance), sd, rtol=0.12)
    for p in (0.05, 0.5, 0.95):
        assert np.all(np.abs(m.quantile(p) - np.quantile(samples, p, axis=0)) < 0.15 * sd)


def test_far_from_the_bounds_nothing_changes():
    C, x = correlated(9), np.full(6, 0.5)
    m = in_unit_box(x, C)
    assert np.array_equal(m.mean, x)
    assert np.allclose(m.quantile(0.975) - x, 1.96 * np.sqrt(np.diag(C)), rtol=1e-3)


def test_an_estimate_far_outside_lies_at_the_bound():
    m = in_unit_box(np.array([-0.5, 1.5, 0.5, 0.5, 0.5, 0.5]), 1e-4 * np.eye(6))
    assert np.isfinite(m.mean).all()
    assert m.mean[0] < 0.01
    assert m.mean[1] > 0.99
    assert np.all(m.quantile(0.95)[0] <= 0.05)
