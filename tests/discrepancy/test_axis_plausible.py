"""Nominal values that no machine has are flagged with what would make them; sound ones are not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.telling.plausible import electrical, find_implausible
from ema.models.axis_config import RotaryAxis

MOTOR = {"kind": "axis", "drive": "current", "J": 5e-5, "F_d": 0.02, "k_t": 0.05, "k_e": 0.0333, "R": 0.5, "L": 3e-4}


def bench(R=0.5, k_e=0.0333, seed=1):
    """A motor that is turned by a current, with its voltage."""
    rng = np.random.default_rng(seed)
    t = np.arange(4000) * 1e-3
    w = 40.0 * np.sin(2 * np.pi * 1.5 * t) + 10.0 * np.sin(2 * np.pi * 4.0 * t)
    i = (5e-5 * np.gradient(w, t) + 0.02 * np.sign(w)) / 0.05
    theta = np.cumsum(w) * 1e-3
    u = R * i + 3e-4 * np.gradient(i, t) + k_e * w + 0.02 * rng.standard_normal(len(t))
    noisy = {"theta_m": theta + 1e-4 * rng.standard_normal(len(t)), "w_m": w + 0.02 * rng.standard_normal(len(t))}
    return Record((Cycle(0, {"t": t, "i_q": i + 2e-3 * rng.standard_normal(len(t)), "u_q": u, **noisy}),))


def said(record, point=None, **changed):
    plant = AxisPlant(RotaryAxis.model_validate({**MOTOR, **changed}), [record])
    return find_implausible(plant, SimpleNamespace(point=point or {"F_d": 0.02}))


def test_a_sound_plant_file_is_left_in_peace():
    assert said(bench()) == []


def test_resistance_and_back_emf_are_read_from_the_record():
    seen = electrical(AxisPlant(RotaryAxis.model_validate(MOTOR), [bench()]))
    assert pytest.approx(0.5, rel=0.05) == seen.R
    assert seen.k_e == pytest.approx(0.0333, rel=0.01)


@pytest.mark.parametrize(
    ("record", "point", "changed", "text"),
    [
        ({"R": 0.15}, None, {}, r"R = 0\.1.* an inverter's drop"),
        ({"k_e": 0.0333 / 3**0.5}, None, {}, r"k_e = 0\.019.*1\.73 times.*line to line"),
        ({}, None, {"k_t": 0.08}, "efficiency of 1.6, above 1"),
        ({}, None, {"k_t": 0.04}, "another kind"),
        ({}, {"F_d": 0.0}, {}, "no dry friction"),
        ({}, {"F_d": 0.02, "J": 4e-4}, {"fitted": ["J"]}, r"J was fitted as 0\.0004 .* 8 times .*gear ratio"),
    ],
)
def test_what_cannot_be_is_flagged_with_what_would_make_it(record, point, changed, text):
    import re

    (one,) = said(bench(**record), point, **changed)
    assert re.search(text, one)


def test_what_is_fitted_without_a_declared_neighbour_is_no_flag():
    (cycle,) = bench().cycles
    beside = Record((Cycle(0, {**cycle.channels, "theta_n": 0.1 * np.sin(cycle["t"])}),))
    assert said(beside, {"F_d": 0.02, "J": 4e-4}, fitted=["J"], neighbour="inner") == []


def test_a_motor_that_rolls_at_one_voltage_shows_no_resistance():
    """The current hardly changes: least squares finds its noise, and a sixth of R."""
    rng = np.random.default_rng(2)
    t = np.arange(4000) * 1e-3
    w = 20.0 + 0.3 * np.sin(12.0 * 20.0 * t)
    i = (1.0 - 0.0333 * w) / 0.5
    noisy = {"i_q": i + 0.02 * rng.standard_normal(len(t)), "w_m": w + 0.06 * rng.standard_normal(len(t))}
    record = Record((Cycle(0, {"t": t, "u_q": np.ones(len(t)), "theta_m": np.cumsum(w) * 1e-3, **noisy}),))
    assert said(record) == []
