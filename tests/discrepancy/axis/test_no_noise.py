"""A record without any noise: what a simulation is exact to is a bound, of whatever shape, and no white noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Cycle
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.noise import estimate
from ema.discrepancy.verdict import BOUND, judge
from ema.models.axis_config import RotaryAxis

T = np.arange(2000) * 1e-3
SMOOTH = 10.0 * np.sin(2.0 * np.pi * T)  # rms 7.1


def channel(x) -> tuple[Cycle, ...]:
    return (Cycle(0, {"t": T, "w_m": x}),)


def test_of_a_channel_without_noise_only_a_bound_is_known():
    assert estimate(channel(SMOOTH), "w_m", None, size=7.1).is_bound
    assert estimate(channel(np.round(SMOOTH, 4)), "w_m", None, size=7.1).is_bound  # as it was written


@pytest.mark.parametrize("sigma", [0.05, 5e-4])
def test_a_sensor_may_be_better_than_what_a_simulation_is_expected_to_be(sigma):
    noisy = SMOOTH + sigma * np.random.default_rng(0).standard_normal(len(T))
    found = estimate(channel(noisy), "w_m", None, size=7.1)
    assert not found.is_bound
    assert found.sigma == pytest.approx(sigma, rel=0.15)


def test_what_moves_slowly_within_a_bound_is_no_cause_and_beyond_it_is():
    slow = [np.sin(np.linspace(0.0, 20.0, 400))[None, :] for _ in range(4)]
    assert not judge(slow, noise_uncertainty=0.1).is_noise
    assert judge(slow, noise_uncertainty=BOUND).is_noise
    assert not judge([4.0 * x for x in slow], noise_uncertainty=BOUND).is_noise


@pytest.fixture(scope="module")
def fine_encoder(support):
    """An axis whose encoder shows no noise, by a current that does, with what is hidden of its drag (drag by rate)."""
    other = support("axis_other")

    def made(hidden, seed):
        noise = {"position": 2e-7, "speed": 0.05, "drive": 0.02, "u": 0.02, "i": 5e-3}
        of = [0.0] * 8
        of[other.VISCOUS] = hidden
        setup = replace(
            other.SETUPS["clean"], noise=noise, counts=1e-6, channels=("i_q", "theta_m"), duration=4.0, hidden=tuple(of)
        )
        return AxisPlant(RotaryAxis.model_validate(other.plant(setup)), [other.record(setup, seed)])

    return made


def test_noise_that_a_current_shows_and_the_motion_integrates_is_no_bound(fine_encoder):
    sample, few, many = fine_encoder(0.0, 1).noise_uncertainties
    assert sample > few > many
    assert many < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_what_is_seen_beside_the_noise_of_the_current_is_named_though_the_encoder_has_none(fine_encoder, seed):
    """Samples one by one are within what a simulation may miss of the encoder; their averages are not."""
    assert examine_ways(fine_encoder(0.0, seed)).verdict == "adequate"
    (drag,) = examine_ways(fine_encoder(6e-5, seed)).effects
    assert drag["name"] == "viscous_drag"
    low, high = (drag["parameters"]["coefficient"][end] for end in ("low", "high"))
    assert low < 6e-5 < high


@pytest.mark.slow
def test_drag_beside_bristles_is_named_without_a_gear_that_gives(support):
    other = support("axis_other")
    setup = other.SETUPS["clean"]
    hidden = [0.0] * 8
    hidden[other.VISCOUS] = 1.2 * setup.F_d / max(m[0] for m in setup.motions)
    record = other.record(replace(setup, hidden=tuple(hidden)), 1)
    (drag,) = examine_ways(AxisPlant(RotaryAxis.model_validate(other.plant(setup)), [record])).effects
    assert drag["name"] == "viscous_drag"
    assert drag["confidence"] > 0.9
