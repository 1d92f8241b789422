"""A load behind a spring: from where a fit of its resonance begins. The motion of the load is written down."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import on_paper
import pytest

from ema.core.records import Cycle
from ema.discrepancy.axis.finding.gear import DAMPING, gear_candidate
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.fitting import fit
from ema.models.axis_config import RotaryAxis

SHARE, RESONANCE = 0.5, 11.0  # of the inertia, behind the gear; [Hz] of the load against a motor that is held
PARTS = ((1.5, 2.3, 0.3), (0.05, 31.0, 1.1), (0.02, 57.0, 0.4), (0.008, 83.0, 2.0))
AT = {"F_d": on_paper.F_D}


def motor_and_load(shown=lambda t, theta, w: (t, theta, w)):
    """J_l a_l = Δ/c + 2 ζ √(J_l/c) dΔ/dt of each sine of the load; the motor is ahead of it by Δ.

    `shown` is what the recorder makes of the motor's time, angle and speed.
    """
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 4.0, 1e-3)
    J_l = SHARE * on_paper.J
    k = (2.0 * np.pi * RESONANCE) ** 2 * J_l
    theta, w, a, inner = (np.zeros(len(t)) for _ in range(4))
    for A, f, phase in PARTS:
        load = A * np.exp(1j * (f * t + phase))
        motor = load - J_l * f**2 * load / (k + 2j * DAMPING * np.sqrt(J_l * k) * f)
        theta, w, a = theta + motor.imag, w + (1j * f * motor).imag, a - (f**2 * motor).imag
        inner = inner - J_l * (f**2 * load).imag
    tau = (on_paper.J - J_l) * a + inner + on_paper.C * w + on_paper.F_D * np.sign(w)
    t, theta, w = shown(t, theta, w)
    true = {"theta_m": theta, "w_m": w, "i_q": tau / on_paper.K_T}
    noisy = {name: x + on_paper.NOISE[name] * rng.standard_normal(len(t)) for name, x in true.items()}
    return on_paper.plant(Cycle(0, {"t": t, **noisy}))


@pytest.fixture(scope="module")
def resonating():
    return motor_and_load()


def test_the_resonance_is_looked_for_where_it_is(resonating):
    found = gear_candidate(resonating, AT, on_paper.everywhere(resonating))
    (start,) = found.starts
    c, J_l = start["gear_compliance.compliance"], start["gear_compliance.inertia"]
    assert 1.0 / (2.0 * np.pi * np.sqrt(c * J_l)) == pytest.approx(RESONANCE, rel=0.25)
    within = {f.name: f.low < start[f.name] < f.high for f in found.free}
    assert all(is_within for name, is_within in within.items() if not name.endswith("friction"))  # that may be none
    without, there = (resonating.residuals([point], on_paper.everywhere(resonating))[0] for point in (AT, AT | start))
    assert sum(float((r**2).sum()) for r in there) < 0.5 * sum(float((r**2).sum()) for r in without)


BEYOND = 0.05  # of the sensor's angle, and of the clock
SHOWN = {
    "resolver_error.once_sine": lambda t, theta, w: (
        t,
        theta + BEYOND * np.sin(theta),
        w * (1.0 + BEYOND * np.cos(theta)),
    ),
    "clock_skew.rate": lambda t, theta, w: (t / (1.0 + BEYOND), theta, w),
}


def left_of_a_window(plant, flaw):
    """Rms of what the truth leaves of a window, the median of all: friction of a reversal makes more of some."""
    J_l = SHARE * on_paper.J
    damping = DAMPING / np.sqrt(1.0 - SHARE)  # of the reduced inertia
    gear = {"compliance": 1.0 / ((2.0 * np.pi * RESONANCE) ** 2 * J_l), "inertia": J_l, "damping": damping}
    true = AT | {f"gear_compliance.{name}": x for name, x in gear.items()} | flaw
    (left,) = plant.residuals([true], on_paper.everywhere(plant))
    return np.median([np.sqrt(np.mean(r**2)) for r in left])


@pytest.mark.parametrize("flaw", SHOWN)
def test_the_load_begins_where_the_true_motion_of_the_motor_has_brought_it(resonating, flaw):
    """Nobody measures the load: it is worked out of the motor's motion, less what the recorder makes of that."""
    left = left_of_a_window(motor_and_load(SHOWN[flaw]), {flaw: BEYOND})
    assert left == pytest.approx(left_of_a_window(resonating, {}), rel=0.05)


def fitted_gear(plant, F_d):
    """Parameters of the gear that was found, and of the axis, fitted to all windows."""
    every, at = on_paper.everywhere(plant), {"F_d": F_d}
    found = gear_candidate(plant, at, every)
    fitted = fit(plant, [*plant.base, *found.free], {**at, **found.starts[0]}, every, max_iterations=30)
    return {name.removeprefix(f"{found.effect}."): x for name, x in fitted.point.items()}


@pytest.mark.parametrize("behind", [0.016, 0.0])
def test_dry_friction_is_told_on_its_side_of_the_gear(support, behind):
    """At rest it holds a twist, and lets it go later than the motor begins: all of it at the motor, nothing is seen."""
    belt = support("belt_bench")
    file = {"J": belt.J_M + belt.J_L, "F_d": belt.F_M + belt.F_L, "C": belt.C, "k_t": belt.K_T}
    value = fitted_gear(AxisPlant(RotaryAxis.model_validate(file), [belt.record(behind)], n_threads=1), file["F_d"])
    assert value["compliance"] == pytest.approx(1.0 / belt.STIFFNESS, rel=0.1)
    assert value["inertia"] == pytest.approx(belt.J_L, rel=0.1)
    assert value["friction"] == pytest.approx(behind, abs=0.15 * belt.F_L)
    assert value["F_d"] + value["friction"] == pytest.approx(file["F_d"], rel=0.05)


@pytest.mark.parametrize("behind", [0.016, 0.0])
def test_a_motor_that_drives_a_measured_load_through_a_spring(support, behind):
    """What hangs to the spring is the motor then; its dry friction is told from the load's as well."""
    belt = support("belt_bench")
    file = {"J": belt.J_M + belt.J_L, "F_d": belt.F_M + belt.F_L, "C": belt.C, "k_t": belt.K_T, "measured_at": "load"}
    plant = AxisPlant(RotaryAxis.model_validate(file), [belt.record(behind, at_load=True)], n_threads=1)
    plant.between = "held"
    value = fitted_gear(plant, file["F_d"])
    assert value["compliance"] == pytest.approx(1.0 / belt.STIFFNESS, rel=0.1)
    assert value["inertia"] == pytest.approx(belt.J_M, rel=0.1)
    assert value["F_d"] == pytest.approx(behind, abs=0.15 * belt.F_L)
    assert value["F_d"] + value["friction"] == pytest.approx(file["F_d"], rel=0.05)


def test_a_load_that_a_slipping_clutch_drags_along_is_behind_a_gear_that_creeps(support):
    """A torque by the difference of the speeds alone: what hangs behind it follows the motor, and never swings."""
    strange = support("strange")
    axis = strange.Axis()
    _, (damping, share, _) = strange.draw(strange.CLUTCH, axis, np.random.default_rng(3))
    plant = AxisPlant(
        RotaryAxis.model_validate(strange.plant(axis)), [strange.record("clutch", axis, 3, seconds=4.0)], n_threads=1
    )
    plant.between = "held"
    value = fitted_gear(plant, axis.F)
    assert value["inertia"] == pytest.approx(share * axis.J, rel=0.05)
    reduced = share * (1.0 - share) * axis.J
    assert 2.0 * value["damping"] * np.sqrt(reduced / value["compliance"]) == pytest.approx(damping, rel=0.1)


def test_where_it_may_not_be_it_is_not_looked_for(resonating):
    every = on_paper.everywhere(resonating)
    assert gear_candidate(resonating, AT | {"gear_compliance.compliance": 1.0}, every) is None
    at_rest = SimpleNamespace(windows=[SimpleNamespace(static=True)], plant=resonating.plant)
    assert gear_candidate(at_rest, AT, [0]) is None
    by_itself = RotaryAxis.model_validate(
        {"drive": "speed-loop", "J": 1e-4, "F_d": 0.01, "k_t": 0.05, "loop": {"K_w": 1.0}}
    )
    looped = SimpleNamespace(windows=[SimpleNamespace(static=False)], plant=by_itself)
    assert gear_candidate(looped, AT, [0]) is None
