from __future__ import annotations

import numpy as np
import pytest

from ema.identification.sampling import Sampler
from ema.models import hf
from ema.models.envelope import envelope


@pytest.fixture(scope="module")
def i_abc(shipped_plant):
    return hf.simulate(shipped_plant, np.array([0.05, 0.1, 0, 0.05, 0, 0]), seeds=3).i[0]


@pytest.fixture(scope="module")
def sampler(shipped_plant):
    return Sampler(shipped_plant, np.arange(100, 4900, 160))


def measured(sampler, i_abc, *lost_frames, theta_u=0.0, theta_m=0.0):
    missing = np.zeros(5001, bool)
    for frame in lost_frames:
        missing[10 * frame : 10 * frame + 10] = True
    return sampler.measurement(np.where(missing, 0.0, i_abc), missing, theta_u, theta_m)


def test_without_gaps_it_is_the_envelope(sampler, i_abc):
    found = measured(sampler, i_abc)
    assert np.array_equal(found.i_hat, envelope(i_abc, 1e4)[100:4900:160])
    assert found.valid.all()


def test_a_valid_point_is_right_and_an_invalid_one_is_near_a_gap(sampler, i_abc):
    """The limit on the missing share keeps the error of valid points below the switching noise of 6 mA."""
    whole = measured(sampler, i_abc).i_hat
    rng = np.random.default_rng(1)
    errors, n_valid = [], 0
    for _ in range(40):
        first, n = rng.integers(0, 480), rng.integers(1, 20)
        found = measured(sampler, i_abc, *range(first, first + n))
        errors.append((found.i_hat - whole)[found.valid])
        n_valid += found.valid.sum()
        near = np.abs(np.arange(100, 4900, 160)[~found.valid, None] - 10 * np.arange(first, first + n)).min(axis=1)
        assert (near < 60).all()
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 1e-3
    assert n_valid > 0.8 * 40 * 30


@pytest.mark.parametrize("turns", [0, 1, -3, 40])
def test_the_turn_of_the_rotor_is_found_from_the_user(sampler, i_abc, shipped_plant, turns):
    GR = shipped_plant.transmission.GR
    theta_m = 0.7 + 2 * np.pi * turns
    start = measured(sampler, i_abc, theta_u=theta_m / GR + 9e-4, theta_m=0.7).start
    assert start == pytest.approx([theta_m / GR + 9e-4, theta_m / GR], abs=1e-12)


def test_a_start_further_apart_than_any_play_is_unknown(sampler, i_abc):
    """The two sensors do not share their zero: better no start state than a wrong one."""
    assert measured(sampler, i_abc, theta_u=4e-3, theta_m=0.0).start is None


@pytest.mark.parametrize("unknown", [{"theta_u": np.nan}, {"theta_m": np.nan}])
def test_without_a_position_the_start_is_unknown(sampler, i_abc, unknown):
    assert measured(sampler, i_abc, **unknown).start is None


def test_nothing_at_all(sampler, i_abc):
    found = measured(sampler, i_abc, *range(501))
    assert np.isnan(found.i_hat).all()
    assert not found.valid.any()
