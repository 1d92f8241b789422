"""Noise is taken from the recorded drive, and nothing that moves the axis."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.reading.local_polynomials import left_of_noise, smooth
from ema.discrepancy.axis.reading.noise import Noise
from ema.discrepancy.axis.reading.pushed import pushed
from ema.discrepancy.axis.reading.quiet_drive import DEGREE, WIDTHS, quieten
from ema.models.axis_config import RotaryAxis

N, PERIOD, SIGMA = 4000, 1e-3, 0.01
T = PERIOD * np.arange(N)
NO_GAPS = np.array([], int)


def noisy(true, seed=1):
    return true + SIGMA * np.random.default_rng(seed).standard_normal(N)


def test_of_a_slow_drive_most_noise_goes_and_its_waves_stay():
    true = 0.5 * np.sin(2 * np.pi * 2.0 * T) + 0.2 * np.sin(2 * np.pi * 5.0 * T + 1.0)
    quiet, left = quieten(T, noisy(true), NO_GAPS, Noise(SIGMA))
    assert np.mean((quiet - true)[left < 1.0] ** 2) < 0.3 * SIGMA**2
    for f in (2.0, 5.0):
        wave = np.exp(-2j * np.pi * f * T)
        assert abs((quiet - noisy(true)) @ wave) < 0.02 * abs(true @ wave)


def test_a_jump_stays_where_it_is():
    true = np.where(T < 1.7003, -0.3, 0.4)
    quiet, left = quieten(T, noisy(true), NO_GAPS, Noise(SIGMA))
    assert np.abs(quiet - true).max() < 5.0 * SIGMA  # 70 across the jump
    moved = np.cumsum(quiet - true) * PERIOD  # speed, per gain
    assert np.abs(moved).max() < 4.0 * SIGMA * PERIOD * np.sqrt(N)
    assert np.median(left) < 0.2


def test_a_drive_without_noise_of_its_own_and_the_ends_of_a_part_stay_as_recorded():
    x = noisy(np.sin(9.0 * T))
    assert (quieten(T, x, NO_GAPS, Noise(SIGMA, is_bound=True))[0] == x).all()
    quiet, left = quieten(T, x, np.array([1500]), Noise(SIGMA))
    ends = [0, 1, 2, 1497, 1498, 1499, 1500, 1501, 1502, N - 3, N - 2, N - 1]
    assert (quiet[ends] == x[ends]).all()
    assert (left[ends] == 1.0).all()


def test_a_wave_that_is_seen_in_no_sample_alone_is_not_taken_for_noise():
    """Over the record it stands far out of it, as a ripple of the current that holds cogging does."""
    true = 1.2 * SIGMA * np.sin(2 * np.pi * 90.0 * T)
    quiet, _ = quieten(T, noisy(true), NO_GAPS, Noise(SIGMA))
    wave = np.exp(-2j * np.pi * 90.0 * T)
    assert abs(quiet @ wave) > 0.9 * abs(true @ wave)


def test_a_cycle_with_more_noise_than_the_others_is_smoothed_too():
    _, left = quieten(T, np.sin(9.0 * T) + 3.0 * noisy(np.zeros(N)), NO_GAPS, Noise(SIGMA))
    assert np.median(left) < 0.2


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_left_of_noise_is_known(width):
    x = np.random.default_rng(width).standard_normal(200_000)
    for degree in (2, DEGREE):
        assert np.var(smooth(x, NO_GAPS, width, degree=degree)) == pytest.approx(left_of_noise(width, degree), rel=0.1)


def test_a_local_polynomial_goes_up_to_a_gap_and_has_the_slope_of_a_ramp():
    x = np.concatenate([2.0 * T[:100], 5.0 - 3.0 * T[:100]])
    assert smooth(x, np.array([100]), 11) == pytest.approx(x)
    assert smooth(x, np.array([100]), 11, PERIOD) == pytest.approx(np.repeat([2.0, -3.0], 100))


def test_the_drive_accelerates_and_speed_dies_out_by_what_takes_it():
    motor = {"J": 2e-4, "F_d": 0.01, "C": 3e-4, "k_t": 0.05, "k_e": 0.04, "R": 2.0}
    assert pushed(RotaryAxis(drive="current", **motor), "current") == pytest.approx((250.0, 1.5))
    gain, damping = pushed(RotaryAxis(drive="voltage", **motor), "voltage")
    assert (gain, damping) == pytest.approx((125.0, 1.5 + 125.0 * 0.04))
    assert pushed(RotaryAxis(drive="torque", **motor), "force") == pytest.approx((5000.0, 1.5))


def test_a_model_that_is_right_leaves_noise_with_the_quiet_drive_too():
    noise = {"i_q": 20.0 * on_paper.NOISE["i_q"]}
    made = on_paper.cycle()
    rng = np.random.default_rng(8)
    loud = {**made.channels, "i_q": made["i_q"] + noise["i_q"] * rng.standard_normal(made.n_samples)}
    plant = on_paper.plant(type(made)(0, loud))
    assert np.median(np.concatenate([w.left for w in plant.windows])) < 0.5
    (right,) = plant.residuals([{"F_d": on_paper.F_D}], on_paper.everywhere(plant))
    every = np.concatenate(right, axis=1)
    assert np.mean(every**2) == pytest.approx(1.0, abs=0.15)
    assert abs(np.mean(every[:, 1:] * every[:, :-1])) < 0.1
