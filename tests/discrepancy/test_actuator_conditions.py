"""Conditions are read from records of other code than the finder's; where there is nothing to tell, nothing is."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from ema.core import config, resources
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.fitting.fit import excess_at
from ema.discrepancy.actuator.reading.conditions import (
    current_noise,
    position_noise,
    supply_voltage,
    take_recorded_conditions,
)
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.play import find_pressing_load
from ema.discrepancy.actuator.reading.zeros import zero_apart
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import CARRIED, EmaPlant
from ema.discrepancy.extended import write_extended
from ema.models.actuator import Actuator


@pytest.fixture(scope="module")
def cycles(hidden):
    """Two healthy cycles on a supply with 0.2 ohm."""
    return hidden.cycles(hidden.Flaws(source_resistance=0.2), 2, 11)


def prepared(plant, cycles, **changes):
    """The record's signals, channels changed by functions of the channel."""
    altered = [{**c, **{name: change(c[name]) for name, change in changes.items()}} for c in cycles]
    return prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(altered)))])


def test_a_record_of_the_plant_changes_nothing(cycles, shipped_plant):
    plant, notes = take_recorded_conditions(shipped_plant, prepared(shipped_plant, cycles).signals)
    assert plant == shipped_plant
    assert notes == []


def test_a_third_more_noise_on_the_user_is_no_rest_for_a_balance_to_see(hidden, shipped_plant):
    noisy = hidden.cycles(hidden.Flaws(), 2, 11, bench=hidden.Bench(lvdt_noise=5.3e-6))
    plant, _ = take_recorded_conditions(shipped_plant, prepared(shipped_plant, noisy).signals)
    assert plant.sensors.lvdt_noise == pytest.approx(5.3e-6, rel=0.1)


@pytest.mark.parametrize("sd", [0.02, 0.05])
def test_noise_of_the_current_sensors_is_read_from_their_sum(cycles, shipped_plant, sd):
    rng = np.random.default_rng(1)
    noisy = {f"i_{j}": lambda x: x + sd * rng.standard_normal(len(x)) for j in "abc"}
    signals = prepared(shipped_plant, cycles, **noisy).signals
    assert current_noise(shipped_plant, signals) == pytest.approx(np.hypot(sd, 5e-3), rel=0.05)
    assert "sensors.current_noise" in take_recorded_conditions(shipped_plant, signals)[1][0]


def test_noise_of_the_position_is_read_below_and_above_the_step_of_its_converter(hidden, shipped_plant):
    step = shipped_plant.sensors.lvdt_step
    rng = np.random.default_rng(2)

    def converted(x, sd):
        return step * np.round((uniform_filter1d(x, 101) + sd * rng.standard_normal(len(x))) / step)

    for sd in (0.3 * step, 2.0 * step):
        noisy = {"theta_u": partial(converted, sd=sd)}
        record = prepared(shipped_plant, hidden.cycles(hidden.Flaws(), 1, 3), **noisy)
        assert position_noise(shipped_plant, record.signals) == pytest.approx(sd, rel=0.1)


def test_a_position_without_steps_says_nothing_of_the_noise_before_the_converter(cycles, shipped_plant):
    record = prepared(shipped_plant, cycles, theta_u=lambda x: x + 1e-6)
    assert position_noise(shipped_plant, record.signals) is None


def test_the_supply_is_its_voltage_without_load(cycles, shipped_plant):
    assert supply_voltage(shipped_plant, prepared(shipped_plant, cycles).signals) == pytest.approx(48.0, abs=0.02)
    lower = prepared(shipped_plant, cycles, u_dc=lambda x: x - 1.0).signals
    plant, notes = take_recorded_conditions(shipped_plant, lower)
    assert plant.inverter.V_dc == pytest.approx(47.0, abs=0.02)
    assert "47 V in the records, 48 V in the plant file" in notes[0]


def test_commands_that_differ_by_less_than_a_sensors_step_are_two_motions_unless_it_is_noise(hidden, shipped_plant):
    """Ten microradians of command, smooth, left ten times the noise when they were simulated as one motion."""
    (channels,) = hidden.cycles(hidden.Flaws(), 1, 3, (hidden.sine(2e-3, 8.0, 0.5),))
    command, rng = channels["theta_cmd"], np.random.default_rng(5)
    others = (1.005 * command, command + 2e-6 * rng.standard_normal(len(command)), command)
    recorded = [channels, *({**channels, "theta_cmd": other} for other in others)]
    assert prepared(shipped_plant, recorded).motion.tolist() == [0, 1, 0, 0]


def test_an_angle_within_one_turn_is_the_same_angle(cycles, shipped_plant):
    whole = prepared(shipped_plant, cycles)
    wrapped = prepared(shipped_plant, cycles, theta_m=lambda x: x % (2.0 * np.pi))
    for a, b in zip(whole.signals, wrapped.signals, strict=True):
        np.testing.assert_allclose(a.theta_m, b.theta_m, atol=1e-9)


@pytest.mark.parametrize("decimals", [5, 6, 7, 15])
@pytest.mark.parametrize("bits", [12, 16])
def test_steps_of_the_rotor_angle_are_seen_however_few_decimals_a_record_has(cycles, shipped_plant, bits, decimals):
    """Sixteen bits in a file with seven decimals had been no steps, and a torque seven times as noisy as expected."""
    step = 2.0 * np.pi / 2**bits
    record = prepared(shipped_plant, cycles, theta_m=lambda x: np.round(step * np.round(x / step), decimals))
    assert record.angle_step == pytest.approx(step, rel=1e-4)
    assert record.angle_noise == 0.0


def test_an_angle_without_steps_has_none(cycles, shipped_plant):
    assert prepared(shipped_plant, cycles).angle_step == 0.0


@pytest.mark.slow
def test_a_noisier_sensor_is_neither_an_effect_nor_a_fault(hidden, shipped_plant):
    rng = np.random.default_rng(4)
    noisy = {f"i_{j}": lambda x: x + 0.02 * rng.standard_normal(len(x)) for j in "abc"}
    found = examine(
        shipped_plant, prepared(shipped_plant, hidden.cycles(hidden.Flaws(), 2, 5, (hidden.chirp(),)), **noisy)
    )
    assert found.findings.verdict == "adequate"
    assert max(found.findings.gain.k_after) < 0.006


def test_a_user_that_still_swings_starts_with_its_speed(hidden, shipped_plant):
    """Behind a gear that gives, the user swings on when the rotor rests."""
    motions = (hidden.chirp(), hidden.sine(4e-3, 6.0, 0.5))
    soft = hidden.cycles(hidden.Flaws(compliance=2e-5, user_damping=10.0), 3, 11, motions)
    found = prepared(shipped_plant, soft).user_speed
    x = np.array([c["theta_u"][[0, 10, 20]] for c in soft])  # 1 ms apart; the resonance has 21 ms
    rise = (4.0 * x[:, 1] - 3.0 * x[:, 0] - x[:, 2]) / 2e-3
    assert found[0] == 0.0
    assert max(abs(found)) > 5e-3
    assert found == pytest.approx(rise, rel=0.1, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    "flaws",
    [
        pytest.param({"k3": 0.05}, id="faults"),
        pytest.param({"k3": 0.05, "viscous": 6e-5}, id="drag", marks=pytest.mark.further),
    ],
)
def test_comparators_ten_times_as_coarse_are_a_condition_and_no_cause(hidden, shipped_plant, flaws):
    """Another simulator evaluates them every 10 µs: currents overshoot the band, which is no flaw of the actuator."""
    bench = hidden.Bench(substeps=10)
    cycles = hidden.cycles(hidden.Flaws(**flaws), 3, 4, (hidden.chirp(),), bench)
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))
    findings = examine(shipped_plant, prepare(shipped_plant, [record])).findings
    assert [e.name for e in findings.effects] == ["viscous_drag"] * ("viscous" in flaws)
    assert findings.verdict == ("explained" if findings.effects else "adequate")
    assert any("evaluated every 10 µs" in note for note in findings.notes)
    assert findings.gain.k_after[2] == pytest.approx(0.05, abs=0.005)


def examined(hidden, plant, bench, **flaws):
    """Findings on four cycles of two motions."""
    cycles = hidden.cycles(hidden.Flaws(**flaws), 4, 6, bench=bench)
    return examine(plant, prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])).findings


@pytest.mark.parametrize(("k2", "noise"), [(0.0, 4e-6), (0.2, 4e-6), (0.0, 4e-5)])
@pytest.mark.parametrize("zero", [7.5e-6, -1e-4])
def test_zeros_of_rotor_and_user_are_told_apart_in_the_middle_of_the_play(hidden, shipped_plant, zero, k2, noise):
    bench = hidden.Bench(user_zero=zero, lvdt_noise=noise)
    signals = prepared(shipped_plant, hidden.cycles(hidden.Flaws(k2=k2), 2, 12, bench=bench)).signals
    assert zero_apart(shipped_plant, signals) == pytest.approx(-zero, abs=max(5e-7, noise / 15.0))


def test_zeros_are_told_apart_beside_a_resolver_that_wobbles(hidden, shipped_plant):
    """The wobble is ten times the noise of the user's sensor; its mean over a turn is none of the zero."""
    wobble = {"once_cosine": -0.011, "once_sine": -0.013, "twice_cosine": -0.008, "twice_sine": 0.002}
    made = hidden.cycles(hidden.Flaws(**wobble), 2, 12, bench=hidden.Bench(user_zero=-4e-5))
    assert zero_apart(shipped_plant, prepared(shipped_plant, made).signals) == pytest.approx(4e-5, abs=5e-7)


def test_sound_sensors_have_no_zeros_apart_and_a_gear_that_gives_leaves_that_open(hidden, shipped_plant, cycles):
    assert zero_apart(shipped_plant, prepared(shipped_plant, cycles).signals) == 0.0
    soft = hidden.cycles(hidden.Flaws(compliance=2e-5, user_damping=10.0, load=4.0), 2, 13)
    assert zero_apart(shipped_plant, prepared(shipped_plant, soft).signals) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    "flaws",
    [
        pytest.param({"k1": 0.04, "k3": 0.03}, id="faults"),
        pytest.param({"k3": 0.03, "viscous": 6e-5}, id="drag", marks=pytest.mark.further),
    ],
)
def test_a_simulation_without_any_noise_is_a_record_too(hidden, shipped_plant, flaws):
    """Runs without noise of the position switch in step with each other, but not with another simulator's."""
    findings = examined(hidden, shipped_plant, hidden.Bench(current_noise=0.0, lvdt_noise=0.0), **flaws)
    assert [e.name for e in findings.effects] == ["viscous_drag"] * ("viscous" in flaws)
    assert findings.verdict == ("explained" if findings.effects else "adequate")
    assert findings.gain.k_after[2] == pytest.approx(0.03, abs=3e-3)


@pytest.mark.slow
def test_a_zero_of_the_position_sensor_is_a_condition_and_no_cause(hidden, shipped_plant):
    """It had been called a commutation offset of 0.09 rad, and taken a quarter of a short."""
    findings = examined(hidden, shipped_plant, hidden.Bench(user_zero=1e-4), k1=0.04, k3=0.03)
    assert findings.verdict == "adequate"
    assert any("apart in the middle of the play" in note for note in findings.notes)
    assert findings.gain.k_after == pytest.approx((0.04, 0.0, 0.03, 0.0, 0.0, 0.0), abs=3e-3)


@pytest.mark.further
@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "apart"), [(0.05, 0.0), (-0.075, 0.0), (0.05, 0.05)], ids=["resolver", "resolver, back", "drive"]
)
def test_commutation_is_off_whether_the_recorded_angle_is_or_not(hidden, shipped_plant, angle, apart):
    """A drive may commutate by another sensor than the recorded one; the torque dips alike to either side."""
    findings = examined(hidden, shipped_plant, hidden.BENCH, commutation=angle, commutation_apart=apart)
    assert [e.name for e in findings.effects] == ["commutation_offset"]
    found = findings.effects[0].parameters
    assert found["angle"].value == pytest.approx(angle, rel=0.1)
    if "apart" in found:
        assert found["apart"].value == pytest.approx(apart, abs=2e-3)
    assert max(findings.gain.k_after) < 5e-3


@pytest.mark.slow
def test_the_torque_tells_a_small_commutation_offset_from_a_zero_of_the_position_sensor(hidden, shipped_plant):
    """Zeros lie as far apart in both records; where it is the resolver's, the torque dips at every commutation."""
    findings = examined(hidden, shipped_plant, hidden.BENCH, commutation=0.035)
    assert [e.name for e in findings.effects] == ["commutation_offset"]
    assert findings.effects[0].parameters["angle"].value == pytest.approx(0.035, rel=0.05)
    assert examined(hidden, shipped_plant, hidden.Bench(user_zero=-3.5e-5)).verdict == "adequate"


@pytest.mark.slow
@pytest.mark.parametrize(
    "flaws",
    [
        pytest.param({"k1": 0.04, "k3": 0.03}, id="faults"),
        pytest.param({"k3": 0.03, "viscous": 6e-5}, id="drag", marks=pytest.mark.further),
    ],
)
def test_a_recorder_with_the_command_a_sample_late_is_a_condition_and_no_cause(hidden, shipped_plant, flaws):
    findings = examined(hidden, shipped_plant, hidden.Bench(command_late=1), **flaws)
    assert [e.name for e in findings.effects] == ["viscous_drag"] * ("viscous" in flaws)
    assert findings.verdict == ("explained" if findings.effects else "adequate")
    assert any("1 sample late" in note for note in findings.notes)
    assert findings.gain.k_after[2] == pytest.approx(0.03, abs=3e-3)


@pytest.mark.slow
def test_late_comparators_that_went_on_switching_at_rest_do_so_in_the_simulation(hidden, shipped_plant):
    """Within their band no current flows unless they had begun; the truth itself had left a misfit of 140."""
    rng = np.random.default_rng([27, 1, *b"comparator_delay"])
    motions, bench = hidden.drawn_motions(rng), hidden.drawn_bench(rng)
    flaws = hidden.Flaws(reaction=2.91e-6, k5=0.0225, k6=0.0209)
    cycles = hidden.cycles(flaws, 4, 27, motions, bench)[2:]
    data = prepare(shipped_plant, [Record(tuple(Cycle(number, c) for number, c in enumerate(cycles)))])
    assert np.abs(data.holding[1]).max() > 0.1
    truth = {"comparator_delay.time": 2.91e-6, "k5": 0.0225, "k6": 0.0209}
    plant = EmaPlant(take_recorded_conditions(shipped_plant, data.signals)[0], data)
    assert excess_at(plant, Noise(plant, truth), truth, [1]) < 1.0


def test_what_sensors_show_too_much_is_no_current_that_comparators_switch_at_rest(hidden, shipped_plant):
    """Late comparators had been begun as switching where offsets alone were recorded: a misfit that was no cause's."""
    (cycle,) = hidden.cycles(hidden.Flaws(recorder_offset_a=0.1, offset_c=0.12), 1, 3)
    data = prepare(shipped_plant, [Record((Cycle(0, cycle), Cycle(1, cycle)))])
    plant = EmaPlant(shipped_plant, data)
    assert np.abs(data.holding).max() > CARRIED
    shown = {"recorder_offset.offset_a": 0.1, "current_offset.offset_c": 0.12, "comparator_delay.time": 2e-6}
    for point, is_switching in ((shown, False), ({"comparator_delay.time": 2e-6}, True)):
        holding = plant.holding([point], np.array([0]))
        assert (np.abs(holding).max() > CARRIED) == is_switching
        assert (plant.legs([point], holding) < 0.0).any() == is_switching


@pytest.mark.parametrize(
    ("flaws", "is_pressed"),
    [
        ({}, False),
        ({"k2": 0.04}, False),
        ({"load": 3.0}, False),
        ({"spring": 1500.0, "k2": 0.03}, False),
        ({"compliance": 2e-5, "user_damping": 30.0}, False),
        ({"once_sine": 0.01}, False),
        ({"load": 3.0, "holding": 0.5}, True),
        ({"load": -2.0, "holding": 0.5, "k2": 0.05}, True),
        ({"spring": 400.0, "holding": 0.2}, True),
        ({"spring": 1500.0, "holding": 0.5, "k2": 0.03}, True),
    ],
)
def test_a_load_that_presses_the_user_to_one_side_of_the_play_is_seen(hidden, shipped_plant, flaws, is_pressed):
    found = find_pressing_load(shipped_plant, prepared(shipped_plant, hidden.cycles(hidden.Flaws(**flaws), 2, 5)))
    assert (found is not None) is is_pressed


@pytest.mark.slow
def test_a_spring_that_closes_the_play_is_named_and_the_extended_plant_has_the_users_friction(
    hidden, shipped_plant, tmp_path
):
    """With a play that stays where it was pushed, the truth itself left two hundred times the noise."""
    cycles = hidden.cycles(hidden.Flaws(spring=1800.0, holding=2.5, k1=0.03), 4, 3)
    findings = examine(shipped_plant, prepared(shipped_plant, cycles)).findings
    assert findings.verdict == "explained"
    (found,) = findings.effects
    assert (found.name, found.indistinguishable_from) == ("spring_load", ())
    assert found.parameters["stiffness"].value == pytest.approx(1800.0, rel=0.01)
    assert findings.gain.k_after == pytest.approx((0.03, 0.0, 0.0, 0.0, 0.0, 0.0), abs=3e-3)
    write_extended(resources.config("actuator.yaml"), findings.effects, tmp_path / "extended.yaml", findings.fitted)
    extended = config.load(tmp_path / "extended.yaml", Actuator)
    assert extended.transmission.F_u == pytest.approx(2.5, rel=0.15)
    assert extended.transmission.b == shipped_plant.transmission.b
