"""A line that the motion passes faster than half the rate is not seen, and not taken for a slow one."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.balance.laws.law import Acting
from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.laws.motion import Motion
from ema.discrepancy.axis.balance.records.course import courses
from ema.discrepancy.axis.balance.records.integrated import integrate_rows
from ema.discrepancy.axis.balance.records.of_records import every_law, shown_by
from ema.discrepancy.axis.balance.records.widths import half_widths

PERIOD = 1e-3
SPEED = 50.0  # [rad/s]: order 72 passes at 573 Hz, order 12 at 95


def columns(order):
    n = 1000
    t, zero = PERIOD * np.arange(n), np.zeros(n)
    w = np.full(n, SPEED)
    m = Motion(t, w * t, w, zero, zero, zero, np.ones(n), True, np.zeros(n, bool), record=np.zeros(n, int), dT=zero)
    (law,) = [law for law in laws(m, linear=False) if law.key == f"line {order}"]
    return m, np.array(law.columns(m, Acting(zero, zero, zero)))


def test_a_line_that_is_sampled_well_is_as_it_is():
    m, seen = columns(12)
    assert seen == pytest.approx(np.array([np.cos(12.0 * m.theta), np.sin(12.0 * m.theta)]))


def test_a_line_faster_than_half_the_rate_has_no_column():
    _, seen = columns(72)
    assert not seen.any()


def test_a_line_that_passes_within_a_test_function_is_no_law(support):
    """What the function leaves of it is the error of the function: no size of such a line is shown."""
    plant = support("on_paper").plant(support("on_paper").cycle())
    own = courses(plant)
    (name,) = half_widths(own)
    shown = {}
    for half in (0.004, 0.1):
        rows = integrate_rows(plant, own, {name: half}, 0.1)
        shown[half] = {law.key for law in shown_by(rows, every_law(rows, linear=False))}
    assert {"line 200", "line 12"} <= shown[0.004]
    assert "line 200" not in shown[0.1]
    assert "line 12" in shown[0.1]
