"""What columns say of a direction that is hardly felt, and what was simulated at points along it."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.engine.secants import learn_from

D, P = 30, 3
FLAT = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)


@pytest.fixture
def ridge():
    """True columns (D, P) whose first two nearly cancel, and those that differences with noise make of them."""
    rng = np.random.default_rng(5)
    q = np.linalg.qr(rng.standard_normal((D, P)))[0]
    true = np.stack([q[:, 0] + 0.01 * q[:, 1], q[:, 0] - 0.01 * q[:, 1], q[:, 2]], axis=1)
    return true, true + 0.02 * rng.standard_normal((D, P)), rng


def noise(rng, m):
    """Of means at m points, by either half of the seeds."""
    return 0.35 * rng.standard_normal((2, m, D))


def test_a_flat_direction_is_as_long_as_points_along_it_say(ridge):
    true, rough, rng = ridge
    assert np.linalg.norm(rough @ FLAT) > 5.0 * np.linalg.norm(true @ FLAT)
    points = np.array([-600.0, 100.0, 600.0])[:, None] * FLAT
    means = points @ true.T + noise(rng, 3)
    learned = learn_from(rough, points, means)
    assert np.linalg.norm(learned @ FLAT) == pytest.approx(np.linalg.norm(true @ FLAT), rel=0.2)
    across = np.linalg.svd(FLAT[None])[2][1:].T
    assert learned @ across == pytest.approx(rough @ across, abs=2e-3)  # of other directions nothing was told


def test_a_direction_that_is_not_felt_between_points_is_not_taken_for_felt(ridge):
    """All that means differ by there is noise: as long as that they may be, and no longer."""
    _, rough, rng = ridge
    points = np.array([-60.0, 60.0])[:, None] * FLAT
    means = noise(rng, 2)
    learned = learn_from(rough, points, means)
    assert np.linalg.norm(120.0 * learned @ FLAT) < 0.25 * np.sqrt(2.0 * D)


def test_columns_stay_where_what_was_simulated_says_no_other(ridge):
    true, _, rng = ridge
    points = 3.0 * rng.standard_normal((3, P))
    means = points @ true.T + noise(rng, 3)
    assert learn_from(true, points, means) == pytest.approx(true)
    assert learn_from(true, points[:1], means[:, :1]) == pytest.approx(true)
