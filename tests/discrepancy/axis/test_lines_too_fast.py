"""A line that the motion passes faster than half the rate is not seen, and not taken for a slow one."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.balance.law import Acting
from ema.discrepancy.axis.balance.laws import laws
from ema.discrepancy.axis.balance.motion import Motion

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
