"""The user behind a play, against what can be drawn by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.actuator.reading.held import held_user, pressed_user

B = 0.1
SHAFT = np.concatenate([np.linspace(0.0, 1.0, 101), np.linspace(1.0, 0.0, 101)])


def test_a_held_user_stays_where_it_was_pushed_until_the_gap_is_crossed():
    user = held_user(SHAFT, 0.0, B)
    assert user[100] == pytest.approx(1.0 - B)
    assert user[100:121] == pytest.approx(1.0 - B)  # while the shaft goes back by 2 b
    assert user[-1] == pytest.approx(B)


def test_without_a_play_it_is_the_shaft():
    assert held_user(SHAFT, 0.0, 0.0) == pytest.approx(SHAFT)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_load_presses_it_to_one_side_outside_the_friction_that_holds_it(side):
    user = pressed_user(SHAFT, 0.0, B, side, 0.0, 0.5)
    outside = SHAFT > 0.5
    assert user[outside] == pytest.approx(SHAFT[outside] - side * B)
    assert user[:40] == pytest.approx(held_user(SHAFT, 0.0, B)[:40])
