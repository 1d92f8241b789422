"""Speed ripple under one voltage: its orders, and what may make it; nothing where there is noise alone."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.ripple import describe, find_ripples, structure
from ema.models.axis_config import RotaryAxis

SPEED, NOISE = 28.4, 0.1


def cycle(lines=(), seed=1, speed=SPEED):
    """A step of voltage, read at irregular times; lines of the speed by order."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(4e-3, 8e-3, 800))
    t -= t[0]
    theta = speed * (t - 3e-3 * (1.0 - np.exp(-t / 3e-3)))
    w = speed * (1.0 - np.exp(-t / 3e-3)) + NOISE * rng.standard_normal(len(t))
    for amplitude, n, phase in lines:
        w += amplitude * np.sin(n * theta + phase)
    return Cycle(0, {"t": t, "theta_m": theta, "w_m": w, "u_q": np.full(len(t), 0.25)})


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_lines_are_found_with_their_size(speed):
    found = find_ripples(cycle([(0.19, 6, 0.3), (0.06, 1, 1.0)], speed=speed))
    assert {one.order: one.amplitude for one in found} == pytest.approx({6: 0.19, 1: 0.06}, rel=0.2)


def test_noise_has_no_lines():
    assert [find_ripples(cycle(seed=seed)) for seed in range(5)] == [[]] * 5


def test_a_line_that_comes_and_goes_is_none():
    own = cycle([(0.19, 6, 0.3)])
    w = own["w_m"].copy()
    w[400:] = cycle(seed=2)["w_m"][400:]
    assert find_ripples(Cycle(0, {**own.channels, "w_m": w})) == []


def test_causes_stand_beside_each_other_and_what_tells_them_apart():
    plant_file = {"kind": "axis", "drive": "voltage", "J": 1e-5, "F_d": 1e-3, "k_t": 0.03, "k_e": 0.03, "R": 1.0}
    plant = AxisPlant(RotaryAxis.model_validate(plant_file), [Record((cycle([(0.19, 6, 0.3)]),))])
    (text,) = describe(plant)
    torque = float(text.split("a torque of ")[1].split()[0])
    assert torque == pytest.approx(abs(1e-5 * 6j * SPEED + 0.03 * 0.03) * 0.19, rel=0.1)
    assert "order 6" in text
    assert "encoder that errs by 0.0011 rad" in text
    assert "several constant voltages" in text


def test_ripple_is_structure_of_what_is_left():
    plant_file = {"kind": "axis", "drive": "voltage", "J": 1e-5, "F_d": 1e-3, "k_t": 0.03, "k_e": 0.03, "R": 1.0}
    axis = RotaryAxis.model_validate(plant_file)
    found = structure(AxisPlant(axis, [Record((cycle([(0.19, 6, 0.3), (0.06, 1, 1.0)]),))]))
    assert [row["order"] for row in found["ripple"]] == [6, 1]
    assert "ripples at orders 6, 1 per turn" in found["sentences"][0]
    assert structure(AxisPlant(axis, [Record((cycle(),))])) == {}
