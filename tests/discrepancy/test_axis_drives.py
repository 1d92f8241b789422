"""What drives, as benches record it: torque beyond a gear, duty, a position loop, a drive that is off."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.records.course import courses
from ema.discrepancy.axis.balance.records.integrated import integrate_rows
from ema.discrepancy.axis.balance.records.of_records import shown_by
from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.simulating.closed_loop import closed_loop
from ema.models.axis_config import LinearAxis, RotaryAxis


@pytest.fixture(scope="module")
def positioner(support) -> ModuleType:
    return support("positioner")


def changed(record, without=(), **channels):
    (cycle,) = record.cycles
    kept = {name: x for name, x in cycle.channels.items() if name not in without}
    return Record((Cycle(0, {**kept, **channels}),))


def by_name(plant_file, record):
    plant = AxisPlant(RotaryAxis.model_validate(plant_file), [record])
    plant.between = "held"
    found = describe(plant.balance, linear=False)
    return {term["name"]: term["parameters"] for term in found["terms"]}, found["base"]


def test_a_duty_is_a_voltage_by_its_supply(positioner):
    bench = positioner.Servo()
    record, plant = positioner.servo(bench, 1, seconds=8.0), positioner.servo_plant(bench)
    (cycle,) = record.cycles
    duty = changed(record, without=("u_q",), duty=cycle["u_q"] / bench.supply)
    one, other = (AxisPlant(RotaryAxis.model_validate(p), [r]).records[0].cycles[0]["u_q"]
                  for p, r in ((plant, record), ({**plant, "V_dc": bench.supply}, duty)))  # fmt: skip
    np.testing.assert_allclose(one, other, atol=1e-12)
    with pytest.raises(RecordError, match="u_dc"):
        AxisPlant(RotaryAxis.model_validate(plant), [duty])


def test_a_position_loop_without_a_recorded_drive_shows_the_pendulum_by_its_reference_and_gains(positioner):
    bench = positioner.Servo()
    record = changed(positioner.servo(bench, 1), without=("u_q",))
    plant = {**positioner.servo_plant(bench), "V_dc": bench.supply, "position_loop": positioner.SERVO_LOOP}
    terms, _ = by_name(plant, record)
    assert terms["pendulum"]["amplitude"]["value"] == pytest.approx(0.9, rel=0.02)


def test_a_torque_measured_at_the_load_is_taken_through_the_gear(positioner):
    bench = positioner.Servo()
    record = positioner.servo(bench, 1)
    (cycle,) = record.cycles
    w = np.gradient(cycle["theta_m"], cycle["t"])
    held = 0.5 * (cycle["u_q"] + np.roll(cycle["u_q"], 1))
    torque = bench.k_t / bench.R * (held - bench.k_e * w)
    plant = {"kind": "axis", "drive": "torque", "J": 0.01, "F_d": 0.05, "C": 0.04, "fitted": ["J"]}
    at_motor, _ = by_name(plant, changed(record, without=("u_q",), torque=torque))
    beyond = changed(record, without=("u_q",), torque=6.0 * torque)
    at_load, _ = by_name({**plant, "gear": 6.0, "torque_at": "load"}, beyond)
    for found in (at_motor, at_load):
        assert found["pendulum"]["amplitude"]["value"] == pytest.approx(0.9, rel=0.03)


def test_a_force_is_no_drive_of_a_rotary_axis():
    with pytest.raises(ValueError, match="use torque"):
        RotaryAxis.model_validate({"kind": "axis", "drive": "force", "J": 1e-3, "F_d": 0.01})


def test_where_the_drive_is_off_a_voltage_is_not_compared(positioner):
    bench = positioner.Servo()
    record = positioner.servo(bench, 1, off=(6.0, 9.0))
    terms, base = by_name(positioner.servo_plant(bench), record)
    assert set(terms) == {"pendulum"}
    assert base["viscous_drag"]["value"] == pytest.approx(0.04, rel=0.1)


def test_closed_loop_runs_over_the_whole_record_gain_by_what_was_hidden(positioner):
    bench = positioner.Table(C_positive=163.0, C_negative=237.0, hz=500)
    plant_file = {**positioner.table_plant(bench), "position_loop": positioner.TABLE_LOOP}
    plant = AxisPlant(LinearAxis.model_validate(plant_file), [positioner.table(bench, 1, seconds=8.0)])
    base = {"F_d": 20.0, "M": 90.0, "C": 200.0}
    before, after = closed_loop(plant, base), closed_loop(plant, {**base, "viscous_by_direction.difference": -37.0})
    assert after.drive < 0.6 * before.drive
    assert after.position <= before.position


def motor(hz, volts, seconds=4.0):
    """Samples at `hz` of a motor without load, 3 ms and 113 rad/s per volt, driven at 8 kHz."""
    n = round(8000 * seconds)
    u = volts(np.arange(n) / 8000)
    w = np.zeros(n)
    for k in range(n - 1):
        w[k + 1] = w[k] + (113.0 * u[k] - w[k]) / (0.003 * 8000)
    theta = np.cumsum(w) / 8000
    w += 0.05 * np.random.default_rng(2).standard_normal(n)
    every = round(8000 / hz)
    kept = slice(None, None, every)
    t = np.arange(n)[kept] / 8000
    return Record((Cycle(0, {"t": t, "u_q": u[kept], "theta_m": theta[kept], "w_m": w[kept]}),))


MOTOR = {"kind": "axis", "drive": "voltage", "J": 5e-6, "F_d": 1e-4, "k_t": 0.03, "k_e": 0.0088, "R": 0.5}


def test_a_drive_that_changes_faster_than_its_samples_is_refused_and_told_what_would_do():
    rng = np.random.default_rng(4)
    with pytest.raises(
        RecordError, match=r"u_q changes faster than a sample.* steps or sines well below half the rate"
    ):
        AxisPlant(RotaryAxis.model_validate(MOTOR), [motor(160, lambda t: rng.uniform(-2.0, 2.0, len(t)))])
    with pytest.raises(RecordError, match="u_q stays the same but for"):
        AxisPlant(RotaryAxis.model_validate(MOTOR), [motor(160, lambda t: np.where((t % 1.0) < 3e-4, 2.0, 0.0))])


def test_an_axis_that_rests_before_a_step_is_no_clipped_sensor():
    record = motor(160, lambda t: np.where(t < 1.0, 0.0, 0.25))
    (cycle,) = record.cycles
    rests = cycle["t"] < 1.0
    speed = np.where(rests, 0.0, np.abs(cycle["w_m"]))
    assert AxisPlant(RotaryAxis.model_validate(MOTOR), [changed(record, w_m=speed)]).windows


@pytest.mark.parametrize("volts", [lambda t: 0.25 * np.floor(2.0 * t), lambda t: np.sin(2 * np.pi * 3.0 * t)])
def test_steps_and_slow_sines_are_taken(volts):
    assert AxisPlant(RotaryAxis.model_validate(MOTOR), [motor(160, volts)]).windows


def test_a_constant_voltage_shows_no_law_of_friction():
    """The torque by such a voltage is a straight line over speed, whatever the axis does."""
    plant = AxisPlant(RotaryAxis.model_validate(MOTOR), [motor(160, lambda t: np.where(t < 1.0, 0.0, 0.25))])
    assert plant.balance is None


def test_what_one_speed_in_one_direction_cannot_show_is_not_tried(positioner):
    bench = positioner.Table()
    (cycle,) = positioner.table(bench, 1).cycles
    v = np.gradient(np.convolve(cycle["q"], np.full(41, 1 / 41), mode="same"), cycle["t"])
    steady = np.abs(v - 0.25) < 0.004
    edges = np.flatnonzero(np.diff(np.concatenate(([0], steady.astype(int), [0])))).reshape(-1, 2)
    parts = [cycle.rows(int(a), int(b)) for a, b in edges if b - a > 300]
    one_speed = Record(tuple(Cycle(k, part.channels) for k, part in enumerate(parts)))
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [one_speed])
    found = integrate_rows(plant, courses(plant))
    shown = {law.name for law in shown_by(found, list(laws(found.motion, linear=True)))}
    assert not {"constant_load", "quadratic_drag", "viscous_by_direction"} & shown
    assert "spring_load" in shown


@pytest.mark.parametrize("late", [3e-4, -2e-4], ids=["filtered", "early"])
def test_a_drive_that_is_recorded_at_another_time_is_told_so_and_is_no_drifting_clock(axis_bench, late):
    bench, rng = axis_bench.Bench(), np.random.default_rng(3)
    noise, bench.noise = bench.noise, dict.fromkeys(bench.noise, 0.0)
    cycles = []
    for c in axis_bench.record(bench, rng).cycles:
        c.channels["i_q"] = np.interp(c["t"] - late, c["t"], c["i_q"])  # currents run straight there
        loud = {name: c[name] + 0.2 * rms * rng.standard_normal(c.n_samples) for name, rms in noise.items()}
        cycles.append(Cycle(c.number, {name: x[4:-4] for name, x in {**c.channels, **loud}.items()}))
    plant_file = {**axis_bench.PLANT, "noise": {name: 0.2 * rms for name, rms in axis_bench.PLANT["noise"].items()}}
    plant = AxisPlant(RotaryAxis.model_validate(plant_file), [Record(tuple(cycles))])
    outcome = examine_ways(plant)
    (found,) = outcome.effects
    assert outcome.verdict == "explained"
    # a lag of the drive is as late, to first order; nothing makes it early
    of_set = {name.split()[0] for name in (found["name"], *found["indistinguishable_from"])}
    assert of_set == ({"clock_skew"} if late > 0.0 else {"clock_skew", "drive_lag"})
    told = found["parameters"]["time" if found["name"] == "drive_lag" else "late"]["value"]
    assert told == pytest.approx(-late, rel=0.05)
    assert "currents" not in found["parameters"] or found["parameters"]["currents"]["value"] == 0.0
