"""Angle zeros of records beside each other: shifted, turned round in part, or not to be told."""

from __future__ import annotations

import cmath
import math

import pytest

from ema.discrepancy.axis.scanning.overlap import between

OWN = {36.0: 8e-3 * cmath.exp(0.4j), 72.0: 2.5e-3 * cmath.exp(-1.1j)}
NEIGHBOUR = {14.0: 3e-3 * cmath.exp(0.9j), 28.0: 1.2e-3 * cmath.exp(-0.2j)}


def seen_from(lines, zero):
    return {n: z * cmath.exp(1j * n * zero) for n, z in lines.items()}


def turned(lines):
    return {n: -z for n, z in lines.items()}


def test_lines_that_all_lie_elsewhere_are_another_zero():
    zero = between({**OWN, **NEIGHBOUR}, seen_from({**OWN, **NEIGHBOUR}, 0.03))
    assert zero.angle == pytest.approx(0.03, abs=2e-3)
    assert zero.turned == ()


def test_lines_that_turn_round_while_others_stay_are_no_zero():
    """None does it: 28 has twice the order of 14, so what turns 14 round leaves 28 as it is."""
    zero = between({**OWN, **NEIGHBOUR}, {**OWN, **turned(NEIGHBOUR)})
    assert zero.angle == 0.0
    assert zero.turned == (14.0, 28.0)
    assert zero.instead is None


def test_one_line_that_turns_round_may_be_a_zero_half_its_period_off():
    neighbour = {6.0: 0.012 + 0j}
    zero = between({12.0: 0.02j, **neighbour}, {12.0: 0.02j, **turned(neighbour)})
    assert zero.angle == 0.0
    assert zero.turned == (6.0,)
    assert abs(zero.instead) == pytest.approx(math.pi / 6.0, abs=2e-3)


def test_a_line_too_weak_to_matter_decides_nothing():
    weak = {192.0: 2e-4 + 0j}
    zero = between({**OWN, **NEIGHBOUR, **weak}, {**OWN, **turned(NEIGHBOUR), **seen_from(weak, 5e-3)})
    assert zero.turned == (14.0, 28.0)


def test_no_line_in_common_tells_nothing():
    assert between(OWN, NEIGHBOUR).angle is None
