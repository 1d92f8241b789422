"""A start that is measured one step of the position's converter off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.identification.hf import make

WORN = np.array([0.299, 0.227, 0.246, 0.243, 0.202, 0.204])  # with play, the user lies in the middle of a wide gap


def test_positions_are_those_from_which_a_position_is_measured(shipped_plant):
    sensors, rng = shipped_plant.sensors, np.random.default_rng(2)
    theta_u = sensors.positions(sensors.lvdt_step, 200_000, rng)
    assert np.std(theta_u) == pytest.approx(sensors.lvdt_sd, rel=0.01)
    true = rng.uniform(-5.0, 5.0, 400_000) * sensors.lvdt_step
    noisy = true + sensors.lvdt_noise * rng.standard_normal(len(true))
    shown = true[np.round(noisy / sensors.lvdt_step) == 1.0]
    assert np.quantile(theta_u, [0.05, 0.5, 0.95]) == pytest.approx(np.quantile(shown, [0.05, 0.5, 0.95]), abs=3e-7)


def test_runs_scatter_by_what_the_start_may_be_off(coarse_bundle):
    """A worn gear: a whole step off moves the first reversals by many times what comparators scatter."""
    made, n = make(coarse_bundle), 48
    x = np.tile(WORN, (n, 1))
    here, off = (made.model(x, np.array([theta_u, 0.0])) for theta_u in (0.0, coarse_bundle.plant.sensors.lvdt_step))
    exact = made.model(x, None)
    shift = np.abs(off.mean(axis=0) - here.mean(axis=0))
    print((shift / here.std(axis=0)).max(), (shift / exact.std(axis=0)).max())
    assert (shift / exact.std(axis=0)).max() > 4.0
    assert (shift / here.std(axis=0)).max() < 3.2


@pytest.mark.parametrize("method", ["linear", "lf2"])
def test_identifiers_without_runs_are_widened_where_the_start_moves_the_envelope(coarse_bundle, method):
    noise, start = coarse_bundle.noise(method), np.zeros(2)
    exact = replace(noise, start_sd=np.zeros(2))
    wider = np.diag(noise.covariance(start, WORN) - exact.covariance(start, WORN))
    print(method, np.sqrt(wider / np.diag(noise.switching)).round(2))
    assert (wider >= 0.0).all()
    assert np.sqrt(wider / np.diag(noise.switching)).max() > 0.5
    assert np.argmax(wider) < len(wider) // 3  # the first reversals
