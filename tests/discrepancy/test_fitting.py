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

    noisier = None

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


class NoisyInput:
    """y = x / m + noise of 1, where x was recorded with noise: a larger m takes less of that, and seems better."""

    def __init__(self, seed: int, more: float = 0.0):
        rng = np.random.default_rng(seed)
        x = 2.0 * rng.standard_normal((N_BLOCKS, N))
        self.y = x / SLOPE + rng.standard_normal(x.shape)
        self.x = x + NOISE * rng.standard_normal(x.shape)
        self.x += more * NOISE * rng.standard_normal(x.shape)
        self.seed, self.more = seed, more

    def residuals(self, points, blocks):
        return [[(self.y[j] - self.x[j] / p["m"])[None, :] for j in blocks] for p in points]

    @property
    def noisier(self):
        return NoisyInput(self.seed, 1.0) if self.more == 0.0 else None


NOISE = 1.0
MASS = [Free("m", "1", 0.1, 20.0, 1.0, 1.0)]


def test_noise_of_what_drives_makes_nothing_heavier():
    found = [fit(NoisyInput(seed), MASS, {"m": 1.5}, range(N_BLOCKS)) for seed in range(TRIALS)]
    values, sd = np.array([f.point["m"] for f in found]), np.array([np.sqrt(f.covariance[0, 0]) for f in found])
    assert np.mean(values) == pytest.approx(SLOPE, abs=4.0 * np.std(values) / np.sqrt(TRIALS))
    assert np.mean(np.abs(values - SLOPE) < 1.96 * sd) > 0.89  # 3.3 deviations of a share of 150
    plain = NoisyInput(0)
    plain.more = 1e-300  # its noise is not known of
    bent = fit(plain, MASS, {"m": 1.5}, range(N_BLOCKS)).point["m"] - SLOPE
    assert bent > 0.15 * SLOPE
    assert np.median(sd) < np.hypot(1.3 * np.std(values), 0.5 * bent)  # noise is known to within a third
