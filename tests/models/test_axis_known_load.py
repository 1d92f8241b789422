"""A known load in the axis model, against what can be written down."""

from __future__ import annotations

import numpy as np
import pytest

from ema.models import axis
from ema.models.axis_config import RotaryAxis

T = np.arange(0.0, 0.5, 1e-3)
J, K_T, F_D, LOAD = 2e-5, 0.05, 0.004, 0.02
FREE = RotaryAxis(J=J, F_d=0.0, k_t=K_T)
GIVES = {"compliance": 2.0, "inertia": 0.5 * J}  # [rad/(N m), kg m²]
WHERE = ("gear_compliance", "drive_compliance")


def run(recorded, load, *, effects=None, twist=0.0, plant=FREE):
    offsets, start = np.array([0, len(T)]), np.array([[0.0, 0.0, twist, 0.0]])
    return axis.simulate(axis.model(plant, effects), "current", offsets, T, recorded, start, 1e-4, load=load)


def test_a_current_that_carries_the_load_moves_nothing():
    out = run(np.full(len(T), LOAD / K_T), np.full(len(T), LOAD))
    assert np.abs(out[1]).max() < 1e-9


def test_a_load_that_grows_slows_the_axis_by_its_integral():
    out = run(np.zeros(len(T)), LOAD * T)
    np.testing.assert_allclose(out[1], -0.5 * LOAD * T**2 / J, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("effect", WHERE)
def test_behind_a_gear_that_gives_it_twists_the_gear_and_no_more(effect):
    """The user's side is behind the motor where that is measured, and the motor behind it where the user's is."""
    ahead = 1.0 if effect == "gear_compliance" else -1.0
    load = np.full(len(T), LOAD)
    out = run(load / K_T, load, effects={effect: GIVES}, twist=ahead * GIVES["compliance"] * LOAD)
    assert np.abs(out[1]).max() < 1e-9


@pytest.mark.parametrize("effect", WHERE)
def test_a_recorded_motion_under_a_load_leaves_the_same_twist(effect):
    n = len(T)
    load, still = np.full(n, LOAD), np.zeros(n)
    damped = {**GIVES, "damping": 0.5}
    numbers = axis.model(FREE, {effect: damped})
    motion = (np.array([0, n]), T, still, still, load / K_T, np.array([False]))
    (theta, w) = axis.beyond_after(numbers, "current", *motion, 1e-4, load=load)[0]
    twist = GIVES["compliance"] * LOAD
    assert theta == pytest.approx(-twist if effect == "gear_compliance" else twist, rel=1e-3)
    assert abs(w) < 1e-3


def test_what_holds_the_axis_carries_the_load_and_friction_on_its_side():
    plant = FREE.model_copy(update={"F_d": F_D})
    theta, direction = np.zeros(2), np.array([1.0, -1.0])
    i = axis.holding(axis.model(plant), theta, direction, np.arange(2.0), np.full(2, LOAD))
    np.testing.assert_allclose(i, (LOAD + F_D * direction) / K_T, rtol=1e-9)


def test_friction_by_the_load_at_the_output_knows_the_load():
    share, w = 0.1, np.array([5.0, -5.0])
    numbers = axis.model(FREE, {"output_load_friction": {"share": share}})
    zero, load = np.zeros(2), np.array([LOAD, LOAD])
    left = axis.torque_along(numbers, zero, w, zero, np.arange(2.0), zero, load)
    np.testing.assert_allclose(left, -LOAD - share * LOAD * np.sign(w), rtol=1e-9)


@pytest.mark.parametrize("of_inertia", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("torque", [0.3, -0.3])
def test_what_a_gear_loses_of_the_inertia_s_torque_slows_the_acceleration(of_inertia, torque):
    """J α = τ - load - c |load + ε J α| forwards, + c |…| backwards: the α that the simulation has solves it."""
    share = 0.2
    effects = {"output_load_friction": {"share": share, "of_inertia": of_inertia}}
    out = run(np.full(len(T), torque / K_T), np.full(len(T), LOAD), effects=effects)
    alpha = np.diff(out[1])[10:] / np.diff(T)[10:]
    passed_on = LOAD + of_inertia * J * alpha
    np.testing.assert_allclose(J * alpha, torque - LOAD - np.sign(torque) * share * np.abs(passed_on), rtol=1e-6)
