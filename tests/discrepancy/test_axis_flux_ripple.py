"""A torque constant that ripples with the angle, of a simulator of another hand: told by order and size, no cogging."""

from __future__ import annotations

import pytest

from benchmarks import strata_axis
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.further)])
def test_a_torque_constant_that_ripples_is_named_with_order_and_size(seed):
    trial = strata_axis.of_kind("current_ripple", seed, list(strata_axis.PLANTS)[seed % 3])
    assert trial.effects == ("flux_ripple",)
    plant = AxisPlant(RotaryAxis.model_validate(trial.plant_file), trial.records)
    found = findings(plant, examine_ways(plant)).as_dict()["effects"]
    ripple = next(effect for effect in found if effect["name"] == "flux_ripple")
    assert ripple["confidence"] > 0.9
    assert ripple["parameters"]["order"]["value"] in (6, 12, 18)
    share = ripple["parameters"]["amplitude"]["value"] / trial.plant_file["k_t"]
    assert 0.07 < share < 0.22  # hidden: 0.08 to 0.2
    assert not {"cogging", "stribeck", "gear_error"} & {effect["name"] for effect in found}
