"""Time stamps that vary: by the motion, samples were taken then, or evenly, or nothing can be said."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle
from ema.discrepancy.axis.reading.stamps import describe, examine_stamps

PERIOD, N = 1e-3, 4000


def cycle(seed, *, sampled=0.0, stamped=0.0, noise=1e-5):
    """An angle that swings; samples `sampled` off even times, stamps `stamped` off the samples. [s]"""
    rng = np.random.default_rng(seed)
    even = np.arange(N) * PERIOD
    at = even + sampled * rng.standard_normal(N)
    angle = 3.0 * np.sin(2.0 * np.pi * 1.3 * at) + noise * rng.standard_normal(N)
    return Cycle(0, {"t": at + stamped * rng.standard_normal(N), "theta_m": angle})


@pytest.mark.parametrize(
    ("how", "samples"), [({"stamped": 5e-5}, "even"), ({"sampled": 5e-5}, "as stamped"), ({}, "either")]
)
def test_the_motion_tells_whether_samples_or_stamps_vary(how, samples):
    for seed in range(8):
        assert examine_stamps(cycle(seed, **how), "theta_m").samples == samples


def test_their_jitter_is_measured_and_said():
    (sentence,) = describe("bench", (cycle(1, stamped=5e-5),), "theta_m")
    assert examine_stamps(cycle(1, stamped=5e-5), "theta_m").jitter == pytest.approx(5e-5, rel=0.05)
    assert "bench: time stamps jitter by 5e-05 s rms" in sentence
    assert describe("bench", (cycle(1),), "theta_m") == []


def test_an_angle_whose_noise_hides_it_says_nothing():
    wrong = [
        examine_stamps(cycle(seed, stamped=5e-5, noise=0.01), "theta_m").samples == "as stamped" for seed in range(40)
    ]
    assert sum(wrong) <= 1


def test_a_rate_that_drifts_is_no_jitter():
    """Samples of a USB device that is asked more slowly as it goes: half a millisecond a step, had been 53 ms."""
    rng = np.random.default_rng(2)
    t = np.cumsum(np.linspace(5e-3, 5.8e-3, 1300) + 5e-4 * rng.standard_normal(1300))
    theta = 3.0 * np.sin(4.0 * t)
    found = examine_stamps(Cycle(0, {"t": t, "theta_m": theta}), "theta_m")
    assert found.samples == "as stamped"
    assert found.jitter == pytest.approx(5e-4 / np.sqrt(2.0), rel=0.2)
