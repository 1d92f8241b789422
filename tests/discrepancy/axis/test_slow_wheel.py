"""A wheel that is known well and recorded slowly: a law that acts over minutes is no noise, and nothing is no law."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def wheel(support):
    return support("reaction_wheel")


def plant_of(wheel, record):
    return AxisPlant(RotaryAxis.model_validate(wheel.PLANT), [record])


def test_its_speed_is_as_noisy_as_it_is_though_no_simulation_is_expected_to_be_that_good(wheel):
    noise = plant_of(wheel, wheel.record(5)).benches[0].noise["w_m"]
    assert not noise.is_bound
    assert noise.sigma == pytest.approx(wheel.SPEED_NOISE, rel=0.1)


@pytest.mark.slow
def test_drag_that_falls_as_it_warms_is_named_with_its_rate(wheel):
    found = examine_ways(plant_of(wheel, wheel.record(5)))
    (law,) = found.effects
    assert law["name"] == "viscous_by_temperature"
    assert law["confidence"] > 0.9
    rate = law["parameters"]["per_kelvin"]
    assert rate["low"] < wheel.PER_KELVIN < rate["high"]


@pytest.mark.slow
def test_a_wheel_whose_drag_does_not_know_the_temperature_raises_no_alarm(wheel):
    found = examine_ways(plant_of(wheel, wheel.record(6, per_kelvin=0.0)))
    assert found.verdict == "adequate"
    assert not found.effects
