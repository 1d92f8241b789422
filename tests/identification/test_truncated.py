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


@pytest.mark.parametrize("seed", range(4))
def test_the_shortest_interval_holds_its_share_and_none_is_shorter(seed):
    rng = np.random.default_rng(seed)
    m = in_unit_box(rng.choice([-0.03, 0.0, 0.01, 0.5, 0.99, 1.02], 6), correlated(seed))
    for p in (0.5, 0.9, 0.95):
        low, high = m.shortest(p).T
        below = np.linspace(0.0, 1.0 - p, 201)[:, None]
        others = np.array([m.quantile(x + p) - m.quantile(x) for x in below[:, 0]])
        assert np.allclose(high - low, others.min(axis=0), rtol=5e-3)
        assert ((low >= 0) & (high <= 1)).all()


def test_an_absent_fault_lies_within_its_interval():
    m = in_unit_box(np.array([-0.01, 0.0, 0.001, 0.5, 0.5, 1.01]), 1e-4 * np.eye(6))
    low, high = m.shortest(0.9).T
    assert (low[:3] == 0).all()
    assert high[5] == 1


def test_a_bound_moves_what_is_correlated_with_it():
    """Element 1 is ten standard deviations inside, but goes with element 0, which lies eight outside."""
    C = 1e-4 * np.array([[1.0, -0.9], [-0.9, 1.0]])
    m = in_unit_box(np.array([-0.08, 0.1]), C)
    rng = np.random.default_rng(1)
    outside = rng.exponential(1e-2 / 8.0, 100_000)  # element 0 within the box, nearly; then element 1 given that
    given = 0.1 - 0.9 * (outside + 0.08) + 1e-2 * np.sqrt(1.0 - 0.9**2) * rng.standard_normal(100_000)
    assert m.mean[1] == pytest.approx(given[given > 0].mean(), abs=5e-4)


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
