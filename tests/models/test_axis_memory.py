"""Friction with memory, drift and temperature in the axis model, against what can be written down."""

from __future__ import annotations

import numpy as np
import pytest

from ema.models import axis
from ema.models.axis_config import RotaryAxis

T = np.arange(0.0, 0.5, 1e-3)
FREE = RotaryAxis(J=2e-5, F_d=0.0, k_t=0.05)


def run(plant, i, *, effects=None, start=(0.0, 0.0)):
    starts = np.array([[*start, 0.0, 0.0]])
    return axis.simulate(axis.model(plant, effects), "current", np.array([0, len(T)]), T, i, starts, 1e-4)


def dry(**more):
    return FREE.model_copy(update={"F_d": 0.02, "F_s": 0.02, **more})


def test_before_it_slides_an_axis_with_bristles_is_a_spring():
    """A torque far below friction: x = τ δ / F, where the four-state rule does not move."""
    memory = {"friction_memory": {"deflection": 0.05, "damping": 0.5}}
    i = 0.1 * np.minimum(1.0, T / 0.3)  # to 0.005 N m
    start = np.zeros((1, 4))
    model, window = axis.model(dry(), memory), np.array([0, len(T)])
    out = axis.simulate(model, "current", window, T, i, start, 1e-4, bristles=np.zeros(1))
    x = -0.05 * np.log1p(-0.005 / 0.02)  # Dahl: s = 1 - exp(-x/δ)
    assert out[0, -1] == pytest.approx(x, rel=0.02)
    assert not run(dry(), i)[0].any()


def test_after_a_long_way_it_rubs_as_without_memory():
    i = np.full(len(T), 0.5)
    with_memory = run(dry(), i, effects={"friction_memory": {"deflection": 0.01}}, start=(0.0, 20.0))
    np.testing.assert_allclose(with_memory[1], run(dry(), i, start=(0.0, 20.0))[1], rtol=1e-3)


def test_bristles_too_stiff_for_the_step_are_the_four_state_rule():
    i = 0.6 * np.sin(20.0 * T)
    stiff = run(dry(), i, effects={"friction_memory": {"deflection": 1e-7}})
    np.testing.assert_array_equal(stiff, run(dry(), i))


def test_noise_of_the_angle_is_no_way_back():
    """What is built up at the end of a motion that goes one way, with noise a tenth of the deflection."""
    model = axis.model(dry(), {"friction_memory": {"deflection": 0.01}})
    theta = np.linspace(0.0, 0.1, 200) + 1e-3 * np.random.default_rng(1).standard_normal(200)
    motion = (np.array([0, 200]), np.arange(200.0), theta, np.gradient(theta), np.array([False]))
    assert axis.bristles_after(model, *motion, 3e-3)[0] == pytest.approx(1.0, abs=0.01)
    assert axis.bristles_after(model, *motion, 0.0)[0] < 0.9  # what the play is for


def test_friction_that_drifts_brakes_less_and_less():
    """J dω/dt = -F (1 + r t)"""
    out = run(dry(), np.zeros(len(T)), effects={"friction_drift": {"rate": -1.5}}, start=(0.0, 500.0))
    np.testing.assert_allclose(out[1], 500.0 - 0.02 / 2e-5 * (T - 0.75 * T**2), rtol=1e-6)


def test_warm_grease_drags_less():
    """J dω/dt = -C exp(-k ΔT) ω"""
    warm = {"viscous_by_temperature": {"per_kelvin": 0.03, "coefficient": 1e-4}}
    model = axis.model(FREE.model_copy(update={"C": 1e-4}), warm)
    out = axis.simulate(
        model, "current", np.array([0, len(T)]), T, np.zeros(len(T)), np.array([[0.0, 50.0, 0.0, 0.0]]), 1e-4,
        np.array([40.0]),
    )  # fmt: skip
    np.testing.assert_allclose(out[1], 50.0 * np.exp(-1e-4 * np.exp(-1.2) / 2e-5 * T), rtol=1e-3)
