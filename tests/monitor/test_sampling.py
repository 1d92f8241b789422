from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.models import hf
from ema.models.envelope import envelope
from ema.monitor.cycles import AssembledCycle, Span, Tally
from ema.monitor.sampling import Sampler


@pytest.fixture(scope="module")
def cycle(shipped_plant):
    response = hf.simulate(shipped_plant, np.array([0.05, 0.1, 0, 0.05, 0, 0]), seeds=3)
    motion = {
        "theta_u": response.theta_u[0, ::10],
        "theta_m": response.theta_m[0, ::10] % (2 * np.pi),
        "theta_cmd": np.zeros(501),
    }
    none = np.zeros(5001, bool)
    return AssembledCycle(1, 0, Span(0, 0, 0, 5001, 1e-4, 0), response.i[0], none, motion, Tally(), None)


@pytest.fixture(scope="module")
def sampler(shipped_plant):
    return Sampler(shipped_plant, np.arange(100, 4900, 160))


def lost(cycle, *frames):
    missing = np.zeros(5001, bool)
    for frame in frames:
        missing[10 * frame : 10 * frame + 10] = True
    return replace(cycle, i=np.where(missing, 0.0, cycle.i), missing=missing)


def test_without_gaps_it_is_the_envelope(sampler, cycle):
    measured = sampler.measurement(cycle)
    assert np.array_equal(measured.i_hat, envelope(cycle.i, 1e4)[100:4900:160])
    assert measured.valid.all()


def test_a_valid_point_is_right_and_an_invalid_one_is_near_a_gap(sampler, cycle):
    """The limit on the missing share keeps the error of valid points below the switching noise of 6 mA."""
    whole = sampler.measurement(cycle).i_hat
    rng = np.random.default_rng(1)
    errors, n_valid = [], 0
    for _ in range(40):
        first, n = rng.integers(0, 480), rng.integers(1, 20)
        measured = sampler.measurement(lost(cycle, *range(first, first + n)))
        errors.append((measured.i_hat - whole)[measured.valid])
        n_valid += measured.valid.sum()
        near = np.abs(np.arange(100, 4900, 160)[~measured.valid, None] - 10 * np.arange(first, first + n)).min(axis=1)
        assert (near < 60).all()
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 1e-3
    assert n_valid > 0.8 * 40 * 30


@pytest.mark.parametrize("turns", [0, 1, -3, 40])
def test_the_turn_of_the_rotor_is_found_from_the_user(sampler, cycle, shipped_plant, turns):
    GR = shipped_plant.transmission.GR
    theta_m = 0.7 + 2 * np.pi * turns
    motion = {"theta_u": np.array([theta_m / GR + 9e-4]), "theta_m": np.array([0.7])}
    start = sampler.measurement(replace(cycle, motion=motion)).start
    assert start == pytest.approx([theta_m / GR + 9e-4, theta_m / GR], abs=1e-12)


def test_without_the_first_motion_frame_the_start_is_unknown(sampler, cycle):
    assert sampler.measurement(replace(cycle, motion={"theta_u": [np.nan], "theta_m": [np.nan]})).start is None


def test_nothing_at_all(sampler, cycle):
    measured = sampler.measurement(lost(cycle, *range(501)))
    assert np.isnan(measured.i_hat).all()
    assert not measured.valid.any()
