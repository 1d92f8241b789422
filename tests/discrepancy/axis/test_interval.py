"""Intervals of what was drawn hold 95 % of it; a phase near half a turn is not spread over the whole one."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.naming.interval import interval


def test_an_interval_is_as_wide_as_what_was_drawn():
    drawn = np.random.default_rng(1).normal(3.0, 0.5, 20_000)
    assert interval("stiffness", 3.0, drawn) == pytest.approx((3.0 - 0.98, 3.0 + 0.98), abs=0.03)


def test_a_phase_is_known_up_to_whole_turns():
    drawn = np.pi + np.random.default_rng(1).normal(0.0, 0.1, 20_000)
    wrapped = np.angle(np.exp(1j * drawn))
    assert interval("phase", np.pi, wrapped) == pytest.approx((np.pi - 0.196, np.pi + 0.196), abs=0.01)
    low, high = interval("angle", np.pi, wrapped)
    assert high - low > 6.0


def test_one_value_has_no_width():
    assert interval("phase_outer", 3.0, [3.0]) == pytest.approx((3.0, 3.0))
