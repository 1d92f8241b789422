"""Axes of other makers (tests/support/axis_other.py): masses, forces, counts of an encoder, LuGre friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.scanning.weak_form import weak_form
from ema.models.axis_config import LinearAxis, RotaryAxis


def look(axis_other, name, *, held=False, **hidden):
    return look_at(axis_other, replace(axis_other.SETUPS[name], held=held), **hidden)


def with_angles(record, change):
    """The record with its angles through a function."""
    return Record(tuple(Cycle(c.number, {**c.channels, "theta_m": change(c["theta_m"])}) for c in record))


def besides_bristles(outcome, setup):
    """The effects told, less the bristles that each axis of this simulation has; if told, they are as long as these."""
    own = [e["parameters"]["deflection"] for e in outcome.effects if e["name"] == "friction_memory"]
    assert all(deflection["low"] <= setup.bristle <= deflection["high"] for deflection in own)
    return [e for e in outcome.effects if e["name"] != "friction_memory"]


def look_at(axis_other, setup, *, angles=None, fitted=(), **hidden):
    values = [0.0] * 8
    for key, value in hidden.items():
        values[getattr(axis_other, key)] = value
    setup = replace(setup, hidden=tuple(values))
    model = LinearAxis if setup.motion == "linear" else RotaryAxis
    record = axis_other.record(setup, 1)
    plant = model.model_validate({**axis_other.plant(setup), "fitted": list(fitted)})
    return examine_ways(AxisPlant(plant, [with_angles(record, angles) if angles else record]))


@pytest.mark.slow
def test_a_stage_with_nothing_hidden_is_adequate_though_its_encoder_counts(axis_other):
    outcome = look(axis_other, "stage")
    assert outcome.verdict == "adequate"
    assert outcome.effects == []


def test_a_speed_that_repeats_the_encoder_is_no_channel_of_its_own(axis_other):
    setup = axis_other.SETUPS["coarse"]
    plant = AxisPlant(RotaryAxis.model_validate(axis_other.plant(setup)), [axis_other.record(setup, 1)])
    assert plant.benches[0].roles.derived == "w_m"
    assert plant.benches[0].noise["theta_m"].sigma == pytest.approx(setup.counts / 12**0.5, rel=0.05)


@pytest.mark.further
@pytest.mark.slow
def test_drag_of_a_force_driven_mass_is_named_from_its_position_alone(axis_other):
    found = look(axis_other, "stage", VISCOUS=10.0).effects[0]
    assert found["name"] == "viscous_drag"
    assert found["indistinguishable_from"] == []
    assert found["parameters"]["coefficient"]["value"] == pytest.approx(10.0, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stage", "slow"])
def test_a_drive_that_is_held_between_samples_is_a_condition_and_no_late_sensor(axis_other, name):
    outcome = look(axis_other, name, held=True)
    assert outcome.verdict == "adequate"
    assert outcome.effects == []
    assert any("held until the next" in note for note in outcome.notes)


@pytest.mark.further
@pytest.mark.slow
def test_an_effect_far_above_the_noise_does_not_hide_that_the_drive_is_held(axis_other):
    outcome = look(axis_other, "stage", held=True, VISCOUS=10.0)
    (found,) = besides_bristles(outcome, axis_other.SETUPS["stage"])
    assert found["name"] == "viscous_drag"
    assert found["confidence"] > 0.9
    assert found["parameters"]["coefficient"]["value"] == pytest.approx(10.0, rel=0.03)
    assert any("held until the next" in note for note in outcome.notes)


@pytest.mark.slow
def test_what_pulls_once_per_turn_may_be_a_weight(axis_other):
    """A weight and a magnet that pulls once per turn are one law of the angle."""
    found = look(axis_other, "voltage", COGGING=0.02, ORDER=1.0).effects[0]
    assert {found["name"], *found["indistinguishable_from"]} == {"pendulum", "cogging"}
    assert found["confidence"] < 0.9
    assert "unbalanced load" in found["sentence"]


@pytest.mark.further
@pytest.mark.slow
def test_a_constant_force_is_one_with_an_offset_of_the_force_sensor(axis_other):
    """Unequal friction is one with them while the axis moves: before it slides, bristles may tell them apart."""
    found = look(axis_other, "stage", CONSTANT=1.5).effects[0]
    names = {found["name"], *found["indistinguishable_from"]}
    assert names - {"asymmetric_friction"} == {"constant_load", "drive_offset"}
    assert found["confidence"] < 0.9


@pytest.mark.slow
def test_a_drive_that_gives_more_one_way_than_the_other_is_named(axis_other):
    """Force + 0.1 |force|; the effect is what opposes the motion."""
    (found,) = look(axis_other, "stage", EVEN=0.1).effects
    assert found["name"] == "drive_unequal"
    told = found["parameters"]
    assert told["positive"]["value"] == pytest.approx(-0.1, abs=0.001)
    assert told["negative"]["value"] == pytest.approx(0.1, abs=0.001)
    assert told["positive"]["unit"] == "1"  # of a force, and no newtons per ampere
    assert "of the force is lost while it is positive" in found["sentence"]


@pytest.mark.slow
def test_friction_that_falls_fast_with_speed_is_named_though_motion_cannot_be_foretold_for_long(axis_other):
    """Deviations grow thirtyfold in a tenth of a second; windows of 0.4 s and a start elsewhere had missed it."""
    setup = replace(axis_other.BASE, inertia=8e-5, F_d=0.028, F_s=0.045, w_stribeck=7.0, motions=SLOW)
    (found,) = look_at(axis_other, setup, fitted=["J"]).effects
    assert found["name"] == "stribeck"
    assert found["confidence"] > 0.9
    assert found["parameters"]["excess"]["value"] == pytest.approx(0.045 / 0.028 - 1.0, rel=0.1)


SLOW = ((12, 0.5, 0), (30, 1.3, 0), (25, 0.7, -12))


@pytest.mark.further
@pytest.mark.slow
@pytest.mark.parametrize(("own", "name"), [(True, "encoder_error"), (False, "resolver_error")])
def test_an_angle_sensor_off_centre_is_told_with_or_without_a_speed_sensor_of_its_own(axis_other, own, name):
    setup = axis_other.BASE if own else replace(axis_other.SETUPS["encoder"], counts=0.0)
    found = look_at(axis_other, setup, angles=lambda x: x + 0.012 * np.sin(x + 1.1)).effects[0]
    assert found["name"] == name
    assert found["indistinguishable_from"] == []
    assert found["parameters"]["once_cosine"]["value"] == pytest.approx(0.012 * np.sin(1.1), rel=0.05)
    assert found["parameters"]["once_sine"]["value"] == pytest.approx(0.012 * np.cos(1.1), rel=0.05)


def test_turns_that_were_counted_are_no_torque(axis_other):
    """Of an angle a thousand turns on, sums that are not exactly zero had made torques of many newton metres."""
    setup = axis_other.SETUPS["encoder"]
    model, record = RotaryAxis.model_validate(axis_other.plant(setup)), axis_other.record(setup, 1)
    here, there = (
        AxisPlant(model, [with_angles(record, lambda x, turns=turns: x + 2.0 * np.pi * turns)]) for turns in (0, 1000)
    )
    point = {f.name: f.start for f in here.base}
    a, b = (weak_form(plant, point, range(len(plant.blocks))) for plant in (here, there))
    np.testing.assert_allclose(a.y, b.y, atol=0.02 * float(a.sigma.min()))


@pytest.mark.slow
def test_a_mass_that_swings_on_its_spring_needs_little_force_and_shows_all_of_the_spring(axis_other):
    setup = replace(
        axis_other.SETUPS["stage"], inertia=0.5, F_d=0.3, F_s=0.3, C=0.5, gains=(0.0, 3.0), motions=AT_RESONANCE
    )  # fmt: skip
    found = look_at(axis_other, setup, SPRING=380.0).effects[0]
    assert found["name"] == "spring_load"
    assert found["parameters"]["stiffness"]["value"] == pytest.approx(380.0, rel=0.02)
    assert found["parameters"]["stiffness"]["unit"] == "N/m"
    assert found["sentence"].endswith(" N/m")


AT_RESONANCE = ((0.3, 4.3, 0), (0.5, 4.0, 0), (0.4, 5.0, 0), (0.3, 3.6, 0))


@pytest.mark.slow
def test_noise_that_is_a_little_more_than_declared_is_no_cause(axis_other):
    setup = axis_other.BASE
    declared = {"theta_m": 0.94 * 2e-4, "w_m": 0.94 * 0.05, "i_q": 0.94 * 5e-3, "u_q": 0.94 * 0.02}
    plant = RotaryAxis.model_validate({**axis_other.plant(setup), "noise": declared})
    outcome = examine_ways(AxisPlant(plant, [axis_other.record(setup, 1)]))
    assert outcome.verdict == "adequate"
    assert outcome.effects == []


def test_a_stop_between_two_of_few_samples_is_uncertain_where_it_is(axis_other):
    """Bristles stop a little later than the law. Located by eleven samples of speed, stops were taken for sliding.

    Of a right law windows that turn round left 0.31, 0.41 and 0.58 of the noise, all to one side. The axis turns too
    fast to be seen at rest there, and too often for a window to end.
    """
    setup = replace(axis_other.SETUPS["slow"], noise={}, motions=TURNING_FAST)
    noise = {"theta_m": 2e-4, "w_m": 0.05, "i_q": 5e-3, "u_q": 0.02}
    model = RotaryAxis.model_validate({**axis_other.plant(setup), "noise": noise})
    left = []
    for seed in (1, 2, 3):
        plant = AxisPlant(model, [axis_other.record(setup, seed)])
        turning = [j for j, w in enumerate(plant.windows) if np.ptp(np.sign(w.speed)) > 0]
        (residual,) = plant.residuals([{"F_d": setup.F_d}], turning)
        left.append(np.sqrt(np.mean(np.concatenate([r.ravel() for r in residual]) ** 2)))
    assert np.mean(left) < 0.4


TURNING_FAST = ((15, 4, 6), (10, 5, -4))
