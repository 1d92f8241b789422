"""What a record says for a first plant file: inertia, friction, lines, pole pairs, gear; what titles may mean."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import on_paper
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.core.table import Table
from ema.discrepancy.records import begin, first_fit, naming

T = np.arange(0.0, 4.0, 1e-3)


def fit_of(cycle, *, torque=None, linear=False):
    position, speed = ("q", "v") if linear else ("theta_m", "w_m")
    tau = on_paper.K_T * cycle["i_q"] if torque is None else torque
    return first_fit.first_fit([Record((cycle,))], position, speed, [[tau]])


def test_inertia_drag_and_friction_come_back():
    found = fit_of(on_paper.cycle())
    assert found.inertia == pytest.approx(on_paper.J, rel=0.02)
    assert found.drag == pytest.approx(on_paper.C, rel=0.1)
    assert found.friction == pytest.approx(on_paper.F_D, rel=0.05)
    assert found.orders == ()


def test_fast_motion_is_seen_through_the_filter_that_takes_its_derivative():
    swing = on_paper.Swing(((2.5, 2.3, 0.3), (0.02, 180.0, 1.1)))
    assert fit_of(on_paper.cycle(swing=swing)).inertia == pytest.approx(on_paper.J, rel=0.02)


def test_a_torque_locked_to_the_angle_stands_beside_them():
    found = fit_of(on_paper.cycle(lambda t, theta, w: 0.01 * np.sin(12 * theta)))
    assert found.orders == (12.0,)
    assert found.friction == pytest.approx(on_paper.F_D, rel=0.1)


def test_a_pendulum_is_no_inertia():
    found = fit_of(on_paper.cycle(lambda t, theta, w: 0.02 * np.sin(theta + 0.3)))
    assert 1.0 in found.orders
    assert found.inertia == pytest.approx(on_paper.J, rel=0.05)


def test_a_line_that_passes_between_two_samples_is_not_looked_for():
    t = np.arange(0.0, 120.0, 0.02)
    w = 300.0 + 250.0 * np.sin(0.3 * t) + 40.0 * np.sin(1.1 * t)  # up to two turns from one sample to the next
    theta = np.cumsum(w) * 0.02
    torque = on_paper.J * np.gradient(w, t) + on_paper.C * w + on_paper.F_D + 0.5 * np.sin(theta)
    assert fit_of(Cycle(0, {"t": t, "w_m": w}), torque=torque).orders == ()


def test_what_does_not_move_or_has_no_torque_shows_nothing():
    still = Cycle(0, {"t": T, "theta_m": np.zeros(len(T)), "w_m": np.zeros(len(T)), "i_q": np.zeros(len(T))})
    assert fit_of(still) == first_fit.FirstFit(None, None, None)
    rng = np.random.default_rng(1)
    found = fit_of(on_paper.cycle(), torque=1e-3 * rng.standard_normal(6000))
    assert (found.inertia, found.drag, found.friction) == (None, None, None)


def known(record, **sheet):
    return {one.key: one for one in begin.begin_axis([record], begin.Sheet(**sheet))}


def test_each_parameter_is_marked_by_where_it_is_from():
    own = known(Record((on_paper.cycle(),)), k_t=on_paper.K_T)
    assert float(own["J"].value.split()[0]) == pytest.approx(on_paper.J, rel=0.02)
    assert "fitted to the records" in own["J"].origin
    assert own["k_t"].origin == "data sheet"
    assert own["fitted"].value == "[J, C]"  # a start, both
    given = known(Record((on_paper.cycle(),)), k_t=on_paper.K_T, J=3e-4)
    assert (given["J"].value, given["J"].origin) == ("0.0003 kg m^2", "data sheet")
    assert given["fitted"].value == "[C]"
    assert "a guess" in known(Record((on_paper.cycle(),)))["k_t"].origin


def test_of_a_voltage_the_torque_is_what_resistance_leaves():
    cycle = on_paper.cycle()
    u = 0.8 * cycle["i_q"] + on_paper.K_T * cycle["w_m"]
    channels = {"t": cycle["t"], "theta_m": cycle["theta_m"], "w_m": cycle["w_m"], "u_q": u}
    own = known(Record((Cycle(0, channels),)), k_t=on_paper.K_T, R=0.8, brushed=True)
    assert float(own["J"].value.split()[0]) == pytest.approx(on_paper.J, rel=0.05)
    assert float(own["C"].value.split()[0]) == pytest.approx(on_paper.C, rel=0.3)  # a tenth of the back-EMF's drag
    guessed = known(Record((Cycle(0, channels),)), k_t=on_paper.K_T)
    assert "give --R" in guessed["R"].origin
    assert "a guess" in guessed["J"].origin


def test_the_back_emf_of_a_phase_carries_the_power_of_the_torque():
    """Three phases: u i = 3/2 k_e ω i_q = k_t i_q ω; KV is of the line-to-line voltage's amplitude."""
    k_e = begin.back_emf(400.0)
    line_to_line = np.sqrt(3.0) * k_e * (2.0 * np.pi * 400.0 / 60.0)
    assert line_to_line == pytest.approx(1.0)
    own = known(Record((on_paper.cycle(),)), KV=400.0)
    assert float(own["k_t"].value.split()[0]) == pytest.approx(1.5 * k_e, rel=1e-3)


@pytest.mark.parametrize(("without", "why"), [("theta_m w_m", "no motion"), ("i_q", "no drive")])
def test_a_record_without_motion_or_drive_is_refused(without, why):
    cycle = on_paper.cycle()
    channels = {name: x for name, x in cycle.channels.items() if name not in without.split()}
    with pytest.raises(RecordError, match=why):
        begin.begin_axis([Record((Cycle(0, channels),))], begin.Sheet())


def turning(p, sign=1.0):
    theta = 9.0 * T**2
    phases = {f"i_{x}": np.cos(p * theta - k * 2.0 * np.pi / 3.0) * sign for k, x in enumerate("abc")}
    return Record((Cycle(0, {"t": T, "theta_m": theta, **phases}),))


def test_pole_pairs_are_those_by_which_the_currents_turn_with_the_rotor():
    assert begin.pole_pairs(turning(7)) == 7
    braking = {f"i_{x}": turning(7).cycles[0][f"i_{x}"] * np.sign(np.sin(3.0 * T)) for x in "abc"}
    assert begin.pole_pairs(Record((Cycle(0, {**turning(7).cycles[0].channels, **braking}),))) == 7
    rng = np.random.default_rng(0)
    noise = {f"i_{x}": rng.standard_normal(len(T)) for x in "abc"}
    assert begin.pole_pairs(Record((Cycle(0, {**turning(7).cycles[0].channels, **noise}),))) is None
    assert begin.pole_pairs(Record((on_paper.cycle(),))) is None


def test_the_gear_is_the_slope_of_the_motor_over_the_user():
    theta_u = 0.1 * np.sin(3.0 * T)
    assert begin.gear_ratio(Record((Cycle(0, {"t": T, "theta_m": 50.0 * theta_u, "theta_u": theta_u}),))) == (
        pytest.approx(50.0, rel=1e-3)
    )
    assert begin.gear_ratio(Record((on_paper.cycle(),))) is None


def proposed(*titles, units=None):
    table = Table(Path("bench.csv"), list(titles), lambda wanted: [], [], units=units or {})
    return {p.title: (p.channel, p.unit) for p in naming.propose(table)}


def test_a_unit_says_more_than_a_word():
    assert proposed("t [s]", "position [mm]", "speed [m/s]") == {
        "t [s]": ("t", "s"), "position [mm]": ("q", "mm"), "speed [m/s]": ("v", "m/s"),
    }  # fmt: skip
    assert proposed("t", "position", units={0: "s", 1: "deg"})["position"] == ("theta_m", "deg")


def test_a_command_is_no_measurement_and_a_second_column_of_a_kind_is_none():
    found = proposed("time", "position_ref [rad]", "position [rad]", "position 2 [rad]")
    assert found["position_ref [rad]"] == ("theta_ref", "rad")
    assert found["position [rad]"] == ("theta_m", "rad")
    assert found["position 2 [rad]"] == (None, None)


def test_phases_make_an_actuator_and_what_is_unknown_is_left_alone():
    found = proposed("time", "phase a", "phase b", "motor angle [deg]", "command [deg]", "humidity", "pos [counts]")
    assert (found["phase a"][0], found["phase b"][0]) == ("i_a", "i_b")
    assert found["motor angle [deg]"][0] == "theta_m"
    assert found["command [deg]"][0] == "theta_cmd"
    assert found["humidity"] == (None, None)
    assert found["pos [counts]"] == (None, None)
