"""Play of an axis' gear: inertias, free of each other within a gap, that part with a share of their speed."""

from __future__ import annotations

import numpy as np
import pytest

from ema.effects.gear_play import restitution
from ema.models import axis
from ema.models.axis_config import RotaryAxis

J_M, J_L, K_T = 8e-6, 1.2e-5, 0.05
FREE = RotaryAxis(J=J_M + J_L, F_d=0.0, k_t=K_T)
GAP = 0.04
PLAY = {"gap": GAP, "inertia": J_L, "damping": 0.25}
H = 2e-5
T = np.arange(0.0, 0.03, 1e-4)


def run(i, effects, start=(0.0, 0.0), twist=(0.0, 0.0)):
    numbers = axis.model(FREE, effects)
    offsets, starts = np.array([0, len(T)]), np.array([[*start, *twist]])
    return axis.simulate(numbers, "current", offsets, T, np.full(len(T), i), starts, H)


def played(i=0.0, *, start=(0.0, 0.0), twist=(0.0, 0.0), **more):
    return run(i, {"gear_play": {**PLAY, **more}}, start, twist)


@pytest.mark.parametrize("driven", [0.0, 1.0])
def test_within_the_gap_the_motor_is_alone(driven):
    """The measured side moves by the drive, or not at all; beyond the end of the gap both do."""
    i = 0.05
    J_m, J_l = (J_L, J_M) if driven else (J_M, J_L)
    free = 0.95 * np.sqrt(GAP * J_m / (K_T * i)) > T  # half the gap
    w = played(i, driven=driven)[1]
    np.testing.assert_allclose(w[free], 0.0 if driven else K_T * i / J_m * T[free], atol=1e-9)
    assert w[-1] == pytest.approx(K_T * i / (J_m + J_l) * T[-1], rel=0.5)
    assert w[-1] > 0.0


@pytest.mark.parametrize("zeta", [0.05, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("compliance", [0.0, 0.01])
def test_they_part_with_a_share_of_the_speed_at_which_they_met(zeta, compliance):
    """(w_m - w_l)' = -e (w_m - w_l), and together they keep their momentum."""
    w_m, gap, e = 40.0, 0.4, restitution({"damping": zeta})
    met, parted = 0.5 * gap / w_m, 0.5 * gap / w_m + gap / (e * w_m)
    w = played(start=(0.0, w_m), twist=(0.0, w_m), gap=gap, damping=zeta, compliance=compliance)[1]
    together = w_m * J_M / (J_M + J_L)
    exact = together - J_L / (J_M + J_L) * e * w_m
    np.testing.assert_allclose(w[met - 1e-4 > T], w_m, rtol=1e-6)
    longest = np.pi * np.sqrt(max(compliance, 1e-4) * J_M * J_L / (J_M + J_L))
    between = (met + longest + 1e-3 < T) & (parted - 1e-4 > T)
    assert between.sum() > 5
    np.testing.assert_allclose(w[between], exact, atol=0.06 * w_m)


def test_without_a_gap_nothing_is_changed():
    out = played(0.1, gap=0.0)
    np.testing.assert_array_equal(out, run(0.1, {}))


def test_where_the_load_lies_in_its_gap_is_known_after_a_reversal():
    """Wherever it was before: what it did is the motion's doing."""
    numbers = axis.model(FREE, {"gear_play": {**PLAY, "friction": 0.01}})
    t = np.arange(0.0, 1.0, 1e-3)
    theta, w = np.sin(9.0 * t), 9.0 * np.cos(9.0 * t)
    ends = [
        axis.beyond_after(numbers, "current", np.array([0, len(t)]), t, theta + x, w, 0.0 * t, np.array([False]), 1e-4)[
            0
        ]
        - [x, 0.0]
        for x in (0.0, 0.3)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)
    assert abs(ends[0][0] - theta[-1]) == pytest.approx(0.5 * GAP, abs=2e-3)
