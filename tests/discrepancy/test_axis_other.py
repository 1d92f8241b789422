"""Axes of other makers (tests/support/axis_other.py): masses, forces, counts of an encoder, LuGre friction."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ema.discrepancy.axis.between import examined
from ema.discrepancy.axis.plant import AxisPlant
from ema.models.axis_config import LinearAxis, RotaryAxis


def look(axis_other, name, *, held=False, **hidden):
    setup = replace(axis_other.SETUPS[name], held=held)
    values = [0.0] * 8
    for key, value in hidden.items():
        values[getattr(axis_other, key)] = value
    setup = replace(setup, hidden=tuple(values))
    model = LinearAxis if setup.motion == "linear" else RotaryAxis
    return examined(AxisPlant(model.model_validate(axis_other.plant(setup)), [axis_other.record(setup, 1)]))


def test_a_stage_with_nothing_hidden_is_adequate_though_its_encoder_counts(axis_other):
    outcome = look(axis_other, "stage")
    assert outcome.verdict == "adequate"
    assert outcome.effects == []


def test_a_speed_that_repeats_the_encoder_is_no_channel_of_its_own(axis_other):
    setup = axis_other.SETUPS["coarse"]
    plant = AxisPlant(RotaryAxis.model_validate(axis_other.plant(setup)), [axis_other.record(setup, 1)])
    assert plant.benches[0].roles.derived == "w_m"
    assert plant.benches[0].noise["theta_m"].sigma == pytest.approx(setup.counts / 12**0.5, rel=0.05)


def test_drag_of_a_force_driven_mass_is_named_from_its_position_alone(axis_other):
    found = look(axis_other, "stage", VISCOUS=10.0).effects[0]
    assert found["name"] == "viscous_drag"
    assert found["indistinguishable_from"] == []
    assert found["parameters"]["coefficient"]["value"] == pytest.approx(10.0, rel=0.03)


@pytest.mark.parametrize("name", ["stage", "slow"])
def test_a_drive_that_is_held_between_samples_is_a_condition_and_no_late_sensor(axis_other, name):
    outcome = look(axis_other, name, held=True)
    assert outcome.verdict == "adequate"
    assert outcome.effects == []
    assert any("held until the next" in note for note in outcome.notes)


def test_an_effect_far_above_the_noise_does_not_hide_that_the_drive_is_held(axis_other):
    outcome = look(axis_other, "stage", held=True, VISCOUS=10.0)
    assert [e["name"] for e in outcome.effects] == ["viscous_drag"]
    assert outcome.effects[0]["parameters"]["coefficient"]["value"] == pytest.approx(10.0, rel=0.03)
    assert any("held until the next" in note for note in outcome.notes)


def test_what_pulls_once_per_turn_may_be_a_weight(axis_other):
    found = look(axis_other, "voltage", COGGING=0.02, ORDER=1.0).effects[0]
    assert found["name"] == "cogging"
    assert found["indistinguishable_from"] == ["unbalance"]
    assert found["confidence"] < 0.9
    assert "weight" in found["sentence"]


def test_a_constant_force_is_one_with_unequal_friction_and_with_an_offset_of_the_force_sensor(axis_other):
    found = look(axis_other, "stage", CONSTANT=1.5).effects[0]
    names = {found["name"], *found["indistinguishable_from"]}
    assert names == {"constant_load", "asymmetric_friction", "drive_offset"}
    assert found["confidence"] < 0.9


def test_what_the_library_lacks_is_not_named(axis_other):
    outcome = look(axis_other, "stage", EVEN=0.1)
    assert outcome.verdict == "unexplained"
    assert all(e["confidence"] < 0.9 for e in outcome.effects)
