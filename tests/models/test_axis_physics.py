"""The axis model against solutions that can be written down."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ema.core.errors import ConfigError
from ema.models import axis, axis_config
from ema.models.axis_config import LinearAxis, RotaryAxis

T = np.arange(0.0, 0.5, 1e-3)
FREE = RotaryAxis(J=2e-5, F_d=0.0, k_t=0.05, k_e=0.03, R=0.5, L=3e-4)


def run(plant, drive, recorded, *, effects=None, start=(0.0, 0.0), twist=(0.0, 0.0), t=T, h=1e-4, **changed):
    numbers = axis.model(plant, effects, **changed)
    offsets = np.array([0, len(t)])
    return axis.simulate(numbers, drive, offsets, t, np.asarray(recorded, float), np.array([[*start, *twist]]), h)


def test_constant_current_accelerates_evenly():
    out = run(FREE, "current", np.full(len(T), 0.4))
    np.testing.assert_allclose(out[1], 0.05 * 0.4 / 2e-5 * T, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(out[0], 0.5 * 0.05 * 0.4 / 2e-5 * T**2, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(out[3], 0.5 * 0.4 + 0.03 * out[1], rtol=1e-9)


def test_voltage_step_follows_the_exact_solution_of_the_two_coupled_equations():
    J, k_t, k_e, R, L, u = 2e-5, 0.05, 0.03, 0.5, 3e-4, 3.0
    out = run(FREE, "voltage", np.full(len(T), u), h=2e-5)
    A = np.array([[-R / L, -k_e / L], [k_t / J, 0.0]])
    settled = np.array([0.0, u / k_e])
    start = np.array([u / R, 0.0])  # the current is taken as settled where a window begins
    exact = np.array([settled + expm(A * t) @ (start - settled) for t in T])
    np.testing.assert_allclose(out[2], exact[:, 0], atol=0.02 * u / R)
    np.testing.assert_allclose(out[1], exact[:, 1], atol=0.01 * u / k_e)


def test_dry_friction_stops_a_free_axis_after_the_braking_distance_and_holds_it():
    plant = FREE.model_copy(update={"F_d": 0.01, "F_s": 0.02})
    out = run(plant, "current", np.full(len(T), 0.3), start=(0.0, 0.0))
    assert not out[1].any()  # 0.015 N m is below static friction
    out = run(plant, "current", np.zeros(len(T)), start=(0.0, 50.0))
    assert out[1, -1] == 0.0
    assert out[0, -1] == pytest.approx(2e-5 * 50.0**2 / (2.0 * 0.01), rel=2e-3)


def test_an_inertia_that_changes_with_the_angle_keeps_its_energy_and_takes_work_as_any_other():
    """½ J [1 + Δ(θ)] ω² of a crank that runs free; with a constant torque it grows by the torque times the way."""
    crank = {"once_cosine": 0.2, "once_sine": -0.1, "twice_cosine": -0.3, "twice_sine": 0.15}

    def energy(out):
        th = out[0]
        by_angle = 0.2 * np.cos(th) - 0.1 * np.sin(th) - 0.3 * np.cos(2.0 * th) + 0.15 * np.sin(2.0 * th)
        return 0.5 * 2e-5 * (1.0 + by_angle) * out[1] ** 2

    free = run(FREE, "current", np.zeros(len(T)), effects={"inertia_by_angle": crank}, start=(0.4, 40.0), h=2e-5)
    assert np.ptp(free[1]) > 20.0
    np.testing.assert_allclose(energy(free), energy(free)[0], rtol=2e-3)
    driven = run(FREE, "current", np.full(len(T), 0.1), effects={"inertia_by_angle": crank}, start=(0.4, 40.0), h=2e-5)
    np.testing.assert_allclose(energy(driven), energy(driven)[0] + 0.05 * 0.1 * (driven[0] - 0.4), rtol=2e-3)


def test_viscous_drag_and_spring_give_exponential_and_oscillation():
    out = run(FREE, "current", np.zeros(len(T)), effects={"viscous_drag": {"coefficient": 1e-4}}, start=(0.0, 10.0))
    np.testing.assert_allclose(out[1], 10.0 * np.exp(-1e-4 / 2e-5 * T), rtol=1e-3)
    k = 2e-5 * (2.0 * np.pi * 8.0) ** 2
    out = run(FREE, "current", np.zeros(len(T)), effects={"spring_load": {"stiffness": k}}, start=(1.0, 0.0))
    np.testing.assert_allclose(out[0], np.cos(2.0 * np.pi * 8.0 * T), atol=5e-3)


def test_sensors_delay_and_resolver_error_show_in_the_outputs_only():
    i = 0.4 * np.sin(20.0 * T)
    plain = run(FREE, "current", i)
    late = run(FREE, "current", i, effects={"speed_delay": {"time": 3e-3}})
    np.testing.assert_allclose(late[1, 5:], plain[1, 2:-3], atol=1e-9)
    np.testing.assert_array_equal(late[0], plain[0])
    wobble = run(FREE, "current", i, effects={"resolver_error": {"once_sine": 0.01}})
    np.testing.assert_allclose(wobble[0], plain[0] + 0.01 * np.sin(plain[0]), atol=1e-9)
    np.testing.assert_allclose(wobble[1], plain[1] * (1.0 + 0.01 * np.cos(plain[0])), atol=1e-5 * np.ptp(plain[1]))


def test_several_cogging_lines_add_up_in_the_holding_current():
    lines = {
        "cogging": {"amplitude": 0.01, "order": 18.0, "phase": 0.3},
        "cogging#2": {"amplitude": 0.002, "order": 36.0, "phase": -1.0},
    }
    plant = FREE.model_copy(update={"F_d": 0.004, "F_s": 0.004})
    theta = np.linspace(0.0, 2.0 * np.pi, 500)
    torque = 0.01 * np.sin(18 * theta + 0.3) + 0.002 * np.sin(36 * theta - 1.0)
    for direction in (1.0, -1.0):
        held = axis.holding(axis.model(plant, lines), theta, np.full(500, direction), theta)
        np.testing.assert_allclose(held * 0.05, torque + direction * 0.004, atol=1e-9)


def test_a_line_is_held_where_the_angle_is_and_not_where_it_is_measured():
    """A resolver that errs once per turn modulates the phase of a map's line."""
    error = {"once_cosine": 0.01, "once_sine": 0.0, "twice_cosine": 0.0, "twice_sine": 0.0}
    plant = FREE.model_copy(update={"F_d": 0.004, "F_s": 0.004})
    line = {"amplitude": 0.01, "order": 18.0, "phase": 0.3}
    true = np.linspace(0.0, 2.0 * np.pi, 500)
    numbers = axis.model(plant, {"cogging": line, "resolver_error": error})
    held = axis.holding(numbers, true + 0.01 * np.cos(true), np.ones(500), true)
    np.testing.assert_allclose(held * 0.05, 0.01 * np.sin(18 * true + 0.3) + 0.004, atol=1e-6)


def test_halving_the_step_changes_nothing_that_counts():
    i = 0.4 * np.sin(12.0 * T)
    plant = FREE.model_copy(update={"F_d": 0.003, "F_s": 0.003})
    coarse, fine = (run(plant, "current", i, h=h) for h in (2.5e-4, 2.5e-5))
    assert np.max(np.abs(coarse[1] - fine[1])) < 2e-3 * np.max(np.abs(fine[1]))


def test_friction_that_falls_with_speed_is_of_second_order_in_the_step():
    J, F, e, w_s = 7.2e-6, 6.6e-3, 0.38, 8.0
    plant = FREE.model_copy(update={"J": J, "F_d": F, "F_s": F * (1.0 + e)})
    t = T[:80]
    i = 0.132 + 0.25 * np.sin(2.0 * np.pi * 8.0 * t + 1.2)

    def law(at, w):
        return (0.05 * np.interp(at, t, i) - F * (1.0 + e * np.exp(-w / w_s))) / J

    exact = solve_ivp(law, (0.0, t[-1]), [6.0], t_eval=t, rtol=1e-10, atol=1e-10, max_step=1e-4).y[0]
    effects = {"stribeck": {"excess": e, "speed": w_s, "shape": 0.0}}
    coarse, fine = (
        np.abs(run(plant, "current", i, effects=effects, start=(0.0, 6.0), t=t, h=h)[1] - exact).max()
        for h in (1e-3, 2.5e-4)
    )
    assert exact.min() > 0.0
    assert fine < coarse / 12.0  # of 16
    assert fine < 1e-4 * exact.max()


def test_linear_axis_driven_by_force():
    plant = LinearAxis(motion="linear", M=95.0, F_d=20.0, C=200.0, drive="force")
    t = np.arange(0.0, 4.0, 1e-3)
    out = run(plant, "force", np.full(len(t), 60.0), t=t)
    assert out[1, -1] == pytest.approx((60.0 - 20.0) / 200.0 * (1.0 - np.exp(-200.0 * t[-1] / 95.0)), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\n", "drive: current needs k_t"),
        ("kind: axis\nJ: 1 A\nF_d: 0.01\nk_t: 0.1\n", "wrong unit"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nF_s: 0.001\nk_t: 0.1\n", "must not be below"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\neffects: {rust: {depth: 1}}\n", "unknown; known for kind axis"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\neffects: {stribeck: {depth: 1}}\n", "no parameter 'depth'"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\nnoise: {i_z: 1}\n", "unknown channel i_z"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\nfitted: [R]\n", "no value to start from"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\neffects: {supply_sag: {resistance: 1}}\n", "needs V_dc"),
        ("kind: axis\nJ: 1e-5\nF_d: 0.01\nk_t: 0.1\neffects: {gear_compliance: {inertia: 2e-5}}\n", "part of 1e-05"),
    ],
)
def test_wrong_plant_files_are_refused_in_one_line(tmp_path, text, said):
    path = tmp_path / "axis.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        axis_config.load(path)
    assert said in str(caught.value)
    assert str(path) in str(caught.value)


J_M, J_L, C_GEAR = 8e-6, 1.2e-5, 0.6  # together the inertia of FREE
GEAR = {"gear_compliance": {"compliance": C_GEAR, "inertia": J_L, "damping": 0.0}}


def test_a_twisted_gear_swings_at_its_resonance_and_keeps_its_momentum():
    out = run(FREE, "current", np.zeros(len(T)), effects=GEAR, start=(0.0, 100.0), twist=(0.05, 0.0), h=2.5e-5)
    resonance = np.sqrt((1.0 / J_M + 1.0 / J_L) / C_GEAR)
    exact = -0.05 * J_L / (J_M + J_L) * (1.0 - np.cos(resonance * T))  # about the common centre, which rolls on
    np.testing.assert_allclose(out[0] - 100.0 * T, exact, atol=2e-4)


def test_a_gear_that_gives_takes_part_in_the_motion_as_before_when_it_is_slow():
    i = np.full(len(T), 0.01)
    soft = {"gear_compliance": {**GEAR["gear_compliance"], "damping": 0.5}}
    rigid, out = run(FREE, "current", i), run(FREE, "current", i, effects=soft)
    assert out[1, -1] == pytest.approx(rigid[1, -1], rel=2e-3)


def test_the_load_follows_a_recorded_motion_through_the_gear():
    w = np.sqrt(1.0 / (C_GEAR * J_L))  # of the load against a motor that is held
    slow = 0.2 * w
    numbers = axis.model(FREE, {"gear_compliance": {**GEAR["gear_compliance"], "damping": 0.2}})
    t = np.arange(0.0, 3.0, 1e-4)
    theta = 1.0 - np.cos(slow * t)
    half = len(t) // 2
    parts = [slice(0, half), slice(half - 1, len(t))]
    offsets = np.array([0, half, len(t) + 1])
    motion = (np.concatenate([x[part] for part in parts]) for x in (t, theta, slow * np.sin(slow * t)))
    follows = np.array([False, True])
    idle = np.zeros(offsets[-1])
    theta_l, w_l = axis.beyond_after(numbers, "current", offsets, *motion, idle, follows, 1e-4)[-1]
    d = 2.0 * 0.2 * np.sqrt(J_M * J_L / (J_M + J_L) / C_GEAR)
    stiff = 1.0 / C_GEAR + 1j * slow * d
    response = stiff / (stiff - J_L * slow**2)
    swing = -response * np.exp(1j * slow * t[-1])
    assert theta_l == pytest.approx(1.0 + swing.real, abs=2e-3)
    assert w_l == pytest.approx((1j * slow * swing).real, abs=2e-3 * slow)


def test_a_late_position_is_where_the_axis_was_between_samples_and_before_the_first():
    """Under a constant acceleration: straight lines between samples are 0.13 mrad off, and 3.6 before the first."""
    a, late = 0.05 * 0.4 / 2e-5, 2.7e-3
    out = run(FREE, "current", np.full(len(T), 0.4), effects={"position_delay": {"time": late}}, start=(0.2, -30.0))
    then = T - late
    np.testing.assert_allclose(out[0], 0.2 - 30.0 * then + 0.5 * a * then**2, atol=1e-9)


@pytest.mark.parametrize("sensor", ["position", "speed"])
def test_how_late_a_sensor_is_does_not_depend_on_the_clock_of_the_record(sensor):
    i, late, clock = 0.4 * np.sin(20.0 * T), 2.7e-3, 1.02
    effects = {f"{sensor}_delay": {"time": late}}
    right = run(FREE, "current", i, effects=effects)
    off = run(FREE, "current", i, effects=effects | {"clock_skew": {"rate": 1.0 / clock - 1.0}}, t=clock * T)
    np.testing.assert_allclose(off[:2], right[:2], rtol=1e-6, atol=1e-9)


def test_a_load_of_which_nothing_is_known_before_moves_as_its_motor_does():
    numbers = axis.model(FREE, {"gear_compliance": GEAR["gear_compliance"]})
    t = np.arange(0.0, 0.01, 1e-3)
    steady = (np.array([0, len(t)]), t, 40.0 * t, np.full(len(t), 40.0), np.zeros(len(t)), np.array([False]), 1e-4)
    assert axis.beyond_after(numbers, "current", *steady)[0] == pytest.approx([40.0 * t[-1], 40.0], rel=1e-6)


def test_a_supply_that_sags_leaves_less_to_the_motor_and_asks_for_more():
    sag = {"supply_sag": {"resistance": 0.8}}
    plant = FREE.model_copy(update={"V_dc": 6.0})
    rest = {"start": (0.0, 0.0), "t": T[:3]}
    i = np.full(3, 2.0)
    held = plant.model_copy(update={"F_d": 1.0, "F_s": 1.0})
    u = run(held, "current", i, effects=sag, **rest)[3][1]
    bus = 6.0 - 0.8 * 2.0 * u / 6.0
    assert u * bus / 6.0 == pytest.approx(0.5 * 2.0, rel=1e-9)
    asked = run(held, "voltage", np.full(len(T), u), effects=sag)[2]
    assert asked[-1] == pytest.approx(2.0, rel=1e-3)


DRIVEN = {"drive_compliance": {"compliance": C_GEAR, "inertia": J_M, "damping": 0.0}}


@pytest.mark.parametrize("drive", ["current", "voltage"])
def test_a_motor_drives_a_measured_load_through_its_gear(drive):
    """The load by scipy's matrix exponential of both inertias, from rest under a constant current or voltage."""
    k_t, k_e, R = 0.05, 0.03, 0.5
    x = 0.4 if drive == "current" else 3.0
    plant = FREE.model_copy(update={"L": 1e-9})
    out = run(plant, drive, np.full(len(T), x), effects=DRIVEN, h=2.5e-5)
    drag, pull = (0.0, k_t * x) if drive == "current" else (k_t * k_e / R, k_t * x / R)
    s = 1.0 / C_GEAR
    A = np.zeros((5, 5))  # angle and speed of the motor, those of the load, 1
    A[0, 1] = A[2, 3] = 1.0
    A[1, [0, 1, 2, 4]] = np.array([-s, -drag, s, pull]) / J_M
    A[3, [0, 2]] = np.array([s, -s]) / J_L
    exact = np.array([expm(A * t) @ [0.0, 0.0, 0.0, 0.0, 1.0] for t in T])
    np.testing.assert_allclose(out[0], exact[:, 2], atol=1e-3 * np.ptp(exact[:, 2]))
    np.testing.assert_allclose(out[1], exact[:, 3], atol=5e-3 * np.ptp(exact[:, 3]))
    if drive == "current":
        np.testing.assert_allclose(out[3], R * x + k_e * exact[:, 1], atol=5e-3 * np.ptp(out[3]))


def test_the_motor_before_a_measured_load_is_where_its_drive_has_brought_it():
    """The load moves as a free pair of both inertias would under a sine of torque: so does the motor that is found."""
    f, pull = 30.0, 2e-3
    t = np.arange(0.0, 3.0, 1e-4)
    s, d = 1.0 / C_GEAR, 2.0 * 0.2 * np.sqrt(J_M * J_L / (J_M + J_L) / C_GEAR)
    stiff = s + 1j * f * d
    motor, load = np.linalg.solve([[stiff - J_M * f**2, -stiff], [-stiff, stiff - J_L * f**2]], [pull, 0.0])
    swing = np.exp(1j * f * t)
    numbers = axis.model(FREE, {"drive_compliance": {**DRIVEN["drive_compliance"], "damping": 0.2}})
    motion = ((load * swing).imag, (1j * f * load * swing).imag, (pull * swing).imag / 0.05)
    theta, w = axis.beyond_after(numbers, "current", np.array([0, len(t)]), t, *motion, np.array([False]), 1e-4)[0]
    assert theta == pytest.approx((motor * swing[-1]).imag, abs=0.02 * abs(motor))
    assert w == pytest.approx((1j * f * motor * swing[-1]).imag, abs=0.02 * f * abs(motor))
