"""The regression on the balance, on benches with a position loop: laws are named, and none made up."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.balance.records.of_records import balance
from ema.discrepancy.axis.balance.telling.telling import describe, sentences
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.smooth import bumps_at, local_polynomial
from ema.models.axis_config import LinearAxis, RotaryAxis


@pytest.fixture(scope="module")
def positioner(support) -> ModuleType:
    return support("positioner")


def of_table(positioner, seed=1, **hidden):
    bench = positioner.Table(**hidden)
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [positioner.table(bench, seed)])
    plant.between = "held"
    return describe(balance(plant), linear=True)


def of_servo(positioner, seed=1, **hidden):
    bench = positioner.Servo(**hidden)
    plant = AxisPlant(RotaryAxis.model_validate(positioner.servo_plant(bench)), [positioner.servo(bench, seed)])
    plant.between = "held"
    return describe(balance(plant), linear=False)


def by_name(found):
    return {term["name"]: term for term in found["terms"]}


def holds(q, truth, room=0.01):
    """Whether the interval of 95 % holds the truth, or nearly."""
    return q["low"] - room * abs(truth) <= truth <= q["high"] + room * abs(truth)


def test_nothing_hidden_needs_inertia_friction_and_drag_alone(positioner):
    found = of_table(positioner)
    assert found["terms"] == []
    assert found["explained"]["with_laws"] > 0.999
    truth = {"inertia": 90.0, "dry_friction": 20.0, "viscous_drag": 200.0}
    assert all(holds(found["base"][name], value) for name, value in truth.items())
    assert found["base"]["inertia"]["plant_file"] == 94.5


def test_viscous_friction_by_direction_is_named(positioner):
    found = of_table(positioner, C_positive=163.0, C_negative=237.0)
    (term,) = found["terms"]
    assert term["name"] == "viscous_by_direction"
    assert term["confidence"] > 0.9
    assert term["indistinguishable_from"] == []
    assert holds(term["parameters"]["difference"], -37.0)
    assert holds(found["base"]["viscous_drag"], 200.0)
    assert "viscous friction differs by direction" in sentences(found)[0]


def test_what_loses_one_polarity_is_a_drive_and_no_friction(axis_bench, hidden_axis):
    bench, plant_file, motions = hidden_axis.drawn(1)
    bench, _, rng = hidden_axis.bench_with(["one_sided_driver"], 1, bench)
    record = axis_bench.record(bench, rng, motions=motions)
    (term,) = describe(balance(AxisPlant(RotaryAxis.model_validate(plant_file), [record])), linear=False)["terms"]
    assert term["name"] == "drive_unequal"
    assert term["confidence"] > 0.9


@pytest.mark.parametrize("hidden", ["resolver_error", "inverter_drop", "speed_delay"])
def test_a_flaw_of_sensor_or_converter_is_no_law_of_the_balance(axis_bench, hidden_axis, hidden):
    bench, plant_file, motions = hidden_axis.drawn(1)
    bench, _, rng = hidden_axis.bench_with([hidden], 1, bench)
    record = axis_bench.record(bench, rng, motions=motions)
    assert describe(balance(AxisPlant(RotaryAxis.model_validate(plant_file), [record])), linear=False)["terms"] == []


def test_a_motor_that_saturates_is_friction_by_the_square_of_its_torque_or_saturation(axis_bench, hidden_axis):
    """No balance of one axis knows whether a torque is lost in the motor or rubbed away behind it."""
    bench, plant_file, motions = hidden_axis.drawn(1)
    bench, _, rng = hidden_axis.bench_with(["saturation"], 1, bench)
    record = axis_bench.record(bench, rng, motions=motions)
    terms = describe(balance(AxisPlant(RotaryAxis.model_validate(plant_file), [record])), linear=False)["terms"]
    assert all("saturation" in t["indistinguishable_from"] for t in terms)


def test_a_constant_force_comes_with_what_no_balance_tells_from_it(positioner):
    term = by_name(of_table(positioner, constant=-6.0))["constant_load"]
    assert {"asymmetric_friction", "drive_offset"} <= set(term["indistinguishable_from"])
    assert holds(term["parameters"]["torque"], -6.0, room=0.05)


def test_a_pendulum_and_friction_that_grows_with_load_are_named_under_a_position_loop(positioner):
    found = of_servo(positioner, by_load=0.25)
    terms = by_name(found)
    assert set(terms) == {"pendulum", "output_load_friction"}
    assert holds(terms["pendulum"]["parameters"]["amplitude"], 0.9)
    assert holds(terms["output_load_friction"]["parameters"]["share"], 0.25, room=0.03)
    assert holds(found["base"]["dry_friction"], 0.06, room=0.05)
    assert found["explained"]["fitted"] < 0.5 < 0.99 < found["explained"]["with_laws"]


@pytest.mark.slow
def test_free_runs_name_what_the_balance_shows_and_the_model_is_extended_by_it(positioner):
    bench = positioner.Servo(by_load=0.25)
    plant = AxisPlant(RotaryAxis.model_validate(positioner.servo_plant(bench)), [positioner.servo(bench, 1)])
    found = findings(plant, examine_ways(plant))
    named = {e.name: e for e in found.effects}
    assert set(named) == {"pendulum", "output_load_friction"}
    assert all(e.confidence > 0.9 for e in named.values())
    assert named["output_load_friction"].parameters["share"].value == pytest.approx(0.25, rel=0.05)
    assert found.gain.heldout_after < 0.05 * found.gain.heldout_before
    assert found.balance["free_run"]["err"] < 2.0 * found.balance["free_run"]["noise_floor"]


def test_a_pendulum_alone_brings_no_friction_of_another_law(positioner):
    assert set(by_name(of_servo(positioner))) == {"pendulum"}


def test_noise_in_the_regressors_takes_nothing_from_the_mass(positioner):
    """An encoder thirty times as coarse: least squares alone finds too little."""
    bench = positioner.Table(counts=6e-5)
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [positioner.table(bench, 1)])
    plant.between = "held"
    found = balance(plant)
    raw, corrected = found.model.coefficients[0], found.corrected.coefficients[0]
    assert abs(corrected - 90.0) < abs(raw - 90.0)
    assert corrected == pytest.approx(90.0, rel=0.01)


@pytest.mark.parametrize("swing", [2e-5, 5e-5])
def test_a_frame_that_swings_takes_nothing_from_the_mass(positioner, swing):
    """45 Hz that no force makes: narrow test functions see it as motion, and a mass of 38 or 10 kg in place of 90."""
    (cycle,) = positioner.table(positioner.Table(), 1, seconds=12.0).cycles
    seen = cycle["q"] + swing * np.sin(2 * np.pi * 45.0 * cycle["t"])
    record = Record((Cycle(0, {**cycle.channels, "q": seen}),))
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(positioner.Table())), [record])
    plant.between = "held"
    found = describe(balance(plant), linear=True)
    assert found["base"]["inertia"]["value"] == pytest.approx(90.0, rel=0.02)
    assert found["terms"] == []


def test_irregular_time_stamps_are_taken_as_they_are(positioner):
    bench = replace(positioner.Table(), C_positive=163.0, C_negative=237.0)
    record = positioner.table(bench, 1)
    (cycle,) = record.cycles
    kept = np.sort(np.random.default_rng(5).choice(cycle.n_samples, cycle.n_samples // 2, replace=False))
    thinned = type(record)((type(cycle)(0, {name: x[kept] for name, x in cycle.channels.items()}),))
    found = describe(
        balance(AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [thinned])), linear=True
    )
    assert by_name(found)["viscous_by_direction"]["parameters"]["difference"]["value"] == pytest.approx(-37.0, rel=0.1)


def test_test_functions_are_exact_on_polynomials_at_any_times():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.5, 1.5, 400)) * 1e-3
    index, phi, first, second, whole = bumps_at(t, np.arange(20, 380, 10), 0.02)
    assert whole.sum() > 20
    x = 7.0 + 3.0 * t + 5.0 * t**2
    np.testing.assert_allclose(phi.sum(axis=1), 1.0)
    np.testing.assert_allclose((first * (7.0 + 3.0 * t[index])).sum(axis=1)[whole], 3.0, rtol=1e-9)
    np.testing.assert_allclose((second * x[index]).sum(axis=1)[whole], 10.0, rtol=1e-6)
    np.testing.assert_allclose(local_polynomial(t, x, 5, 3)[:3], [x, 3.0 + 10.0 * t, 10.0 + 0.0 * t], rtol=1e-6)
