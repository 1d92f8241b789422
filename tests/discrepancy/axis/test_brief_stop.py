"""An axis that stops for some milliseconds and goes on the same way: no window passes the stop."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

J, F_D, RATE, STEP = 1e-5, 2e-3, 1000, 2.0 * np.pi / 2000
SLOPE, RAMP, REST = 500.0, 0.2, 0.004  # [rad/s²], [s], [s]


def slowing(slowest: float) -> tuple[AxisPlant, np.ndarray]:
    """An axis that goes up and down in speed, to `slowest` [rad/s] each time; and the moments of that."""
    fine = 20
    t = np.arange(round(4.0 * RATE) * fine) / (RATE * fine)
    period = 2.0 * RAMP + REST
    phase = t % period
    up = np.minimum(phase, 2.0 * RAMP - phase)
    w = slowest + SLOPE * np.maximum(up, 0.0)
    theta = np.cumsum(w) / (RATE * fine)
    torque = np.where(w > 0.0, F_D, 0.5 * F_D) + J * np.gradient(w, t)
    shown = STEP * np.round(theta[::fine] / STEP)
    record = Record((Cycle(0, {"t": t[::fine], "torque": torque[::fine], "theta_m": shown}),))
    plant = RotaryAxis.model_validate({"kind": "axis", "drive": "torque", "J": J, "F_d": F_D})
    return AxisPlant(plant, [record], n_threads=1), np.arange(1, 9) * period - 0.5 * REST


@pytest.mark.parametrize(("slowest", "is_passed"), [(0.0, False), (20.0, True)])
def test_a_window_ends_where_the_axis_may_have_stopped(slowest, is_passed):
    plant, moments = slowing(slowest)
    passed = [any(w.t[0] < at < w.t[-1] for w in plant.windows) for at in moments]
    assert np.mean(passed) > 0.5 if is_passed else not any(passed)
    assert sum(w.n for w in plant.windows) > 0.7 * 4.0 * RATE
