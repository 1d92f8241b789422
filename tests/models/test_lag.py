"""A drive that is followed with a lag, against a simulation in steps a thousand times as fine as its samples."""

from __future__ import annotations

import numpy as np
import pytest

from ema.models import axis
from ema.models.axis_config import RotaryAxis

LAG = 3e-3


def finely(t, u, between, n=1000):
    """Values at the stamps of a straight drive; of a held one means over the samples that a value stands for."""
    x, out = u[0], np.empty_like(u)
    out[0] = x
    for k in range(len(u) - 1):
        h, mean = (t[k + 1] - t[k]) / n, 0.0
        for m in range(n):
            given = {"straight": u[k] + (m + 0.5) / n * (u[k + 1] - u[k]), "held": u[k], "held before": u[k + 1]}
            middle = x + 0.5 * h / LAG * (given[between] - x)
            x += h / LAG * (given[between] - middle)
            mean += middle / n
        if between == "held":
            out[k] = mean
            out[k + 1] = x
        else:
            out[k + 1] = x if between == "straight" else mean
    return out


@pytest.mark.parametrize("between", ["straight", "held", "held before"])
def test_what_acts_is_the_drive_through_a_filter_of_the_first_order(between):
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.5e-3, 2e-3, 50))
    u = rng.standard_normal(50)
    np.testing.assert_allclose(axis.acting_drive(LAG, t, u, between), finely(t, u, between), atol=1e-6)


def test_a_recorded_drive_that_was_filtered_is_what_acted_before():
    """Smooth beside its samples, as a filter leaves it."""
    t = np.arange(2000) * 2e-4
    acted = np.sin(2.0 * np.pi * 20.0 * t) + 0.3 * np.sin(2.0 * np.pi * 60.0 * t)
    recorded = finely(t, acted, "straight", n=50)
    before = axis.acting_drive(-LAG, t, recorded)
    np.testing.assert_allclose(before[100:-1], acted[100:-1], atol=0.01)


def test_without_a_lag_it_is_the_drive():
    u = np.arange(3.0)
    assert axis.acting_drive(0.0, u, u) is u


def test_a_lag_of_the_plant_file_counts():
    plant = RotaryAxis.model_validate(
        {
            "kind": "axis",
            "drive": "current",
            "J": 1e-4,
            "F_d": 0.01,
            "k_t": 0.05,
            "effects": {"drive_lag": {"time": LAG}},
        }
    )
    assert axis.lag_of_drive(axis.model(plant), "current") == LAG


def test_in_a_speed_loop_the_current_lags():
    """J dω/dt = k_t i and τ di/dt = K_w (ω_ref - ω) - i of a loop that acts all the time: a step's second order."""
    J, k_t, K_w, step, period = 1e-3, 0.1, 0.5, 20.0, 1e-4
    numbers = {"J": J, "F_d": 0.0, "k_t": k_t, "loop": {"K_w": K_w}, "effects": {"drive_lag": {"time": LAG}}}
    plant = RotaryAxis.model_validate({"kind": "axis", "drive": "speed-loop", **numbers})
    t = np.arange(2000) * period
    ends = np.array([0, len(t)])
    asked = np.full(len(t), step)
    # begun where the current is what is asked for: K_w step
    _, w, i, _ = axis.simulate(
        axis.model(plant), "speed-loop", ends, t, asked, np.zeros((1, 4)), period, between="fast"
    )
    poles = np.roots([LAG, 1.0, k_t * K_w / J])
    a = np.linalg.solve([[1.0, 1.0], poles], [-step, k_t / J * K_w * step])
    exact = step + (a @ np.exp(poles[:, None] * t)).real
    np.testing.assert_allclose(w, exact, atol=2e-3 * step)
    np.testing.assert_allclose(i, (a * poles @ np.exp(poles[:, None] * t)).real * J / k_t, atol=4e-3 * K_w * step)


@pytest.mark.parametrize("between", ["fast", "analogue"])
def test_a_speed_loop_that_acts_all_the_time_on_a_late_speed(between):
    """Against steps a hundred times as fine as the samples of the record."""
    J, k_t, K_w, late, period, n = 1e-3, 0.1, 0.5, 2.5e-3, 1e-3, 100
    numbers = {"J": J, "F_d": 0.0, "k_t": k_t, "loop": {"K_w": K_w}, "effects": {"speed_delay": {"time": late}}}
    plant = RotaryAxis.model_validate({"kind": "axis", "drive": "speed-loop", **numbers})
    t = np.arange(300) * period
    asked = 20.0 * np.sin(2.0 * np.pi * 5.0 * t)
    command = np.repeat(asked, n) if between == "fast" else np.interp(np.arange(len(t) * n) * period / n, t, asked)
    w = np.zeros(len(t) * n)
    for k in range(len(w) - 1):
        seen = w[k - round(late / period * n)] if k * period / n >= late else 0.0
        w[k + 1] = w[k] + period / n * k_t / J * K_w * (command[k] - seen)
    ends, start = np.array([0, len(t)]), np.zeros((1, 4))
    found = axis.simulate(axis.model(plant), "speed-loop", ends, t, asked, start, period / 10, between=between)[1]
    shown = np.interp(t - late, t, w[::n])
    np.testing.assert_allclose(found, shown, atol=0.02 * np.abs(w).max())
