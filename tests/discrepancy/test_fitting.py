"""Intervals of a fit hold the truth as often as they say, also where residuals hang together within a block."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.fitting import fit
from ema.discrepancy.plant import Free

N_BLOCKS, N, TRIALS = 30, 40, 150
SLOPE = 2.0


class Toy:
    """y = a x + b x² + an offset of each block of this rms + noise of 1; the model has no offset."""

    def __init__(self, seed: int, offset: float):
        rng = np.random.default_rng(seed)
        self.x = rng.standard_normal((N_BLOCKS, 1)) + 0.3 * rng.standard_normal((N_BLOCKS, N))
        self.y = SLOPE * self.x + 0.5 * self.x**2 + offset * rng.standard_normal((N_BLOCKS, 1))
        self.y += rng.standard_normal(self.y.shape)

    def residuals(self, points, blocks):
        return [[(self.y[j] - p["a"] * self.x[j] - p["b"] * self.x[j] ** 2)[None, :] for j in blocks] for p in points]


@pytest.mark.parametrize("offset", [0.0, 1.0, 3.0])
def test_intervals_of_95_percent_hold_the_truth(offset):
    free = [Free("a", "1", -10.0, 10.0, 1.0, 1.0), Free("b", "1", -10.0, 10.0, 0.0, 1.0)]
    inside = 0
    for seed in range(TRIALS):
        found = fit(Toy(seed, offset), free, {"a": 1.0, "b": 0.0}, range(N_BLOCKS))
        inside += abs(found.point["a"] - SLOPE) < 1.96 * np.sqrt(found.covariance[0, 0])
    assert inside / TRIALS > 0.89  # 3.3 deviations of a share of 150 below
    assert inside / TRIALS <= 1.0 if offset else inside / TRIALS < 0.995


def test_a_fit_of_one_block_has_the_interval_of_its_noise():
    free = [Free("a", "1", -10.0, 10.0, 1.0, 1.0)]
    found = fit(Toy(1, 0.0), free, {"a": 1.0, "b": 0.5}, [0])
    x = Toy(1, 0.0).x[0]
    assert found.covariance[0, 0] == pytest.approx(found.scale**2 / (x @ x), rel=1e-3)
