"""Records the axis cannot be examined with: one line that says what is missing, never a cause."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.errors import RecordError
from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

PLANT = RotaryAxis(J=5e-5, F_d=0.02, k_t=0.05)
T = np.arange(0.0, 1.0, 1e-3)
I = np.sin(9.0 * T)
W = 20.0 * np.sin(9.0 * T) + 0.01 * np.cos(900.0 * T)
SHAKEN = np.convolve(np.random.default_rng(0).standard_normal(len(T)), np.hanning(60) / 5.0, mode="same")
FOLLOWS = 50.0 + np.cumsum(0.05 * SHAKEN - 0.02) / 5e-5 * 1e-3


def there_and_back(steps_per_turn=4096):
    """Position of an axis that goes to a place, rests there and comes back, by an encoder. [rad]"""
    w_m = 20.0 * (np.clip((T - 0.1) / 0.05, 0.0, 1.0) - np.clip((T - 0.3) / 0.05, 0.0, 1.0))
    step = 2.0 * np.pi / steps_per_turn
    return step * np.floor(np.cumsum(w_m - w_m[::-1]) * 1e-3 / step)


def record(**channels):
    return Record((Cycle(0, {"t": T, **channels}),))


@pytest.mark.parametrize(
    ("measured", "said"),
    [
        (record(i_a=I, w_m=W), "missing channel i_q [A]"),
        (record(i_q=I), "missing channel theta_m [rad] or w_m [rad/s]"),
        (record(i_q=I, w_m=np.full(len(T), 3.0)), "does not move"),
        (record(i_q=I, w_m=np.clip(W, -15.0, 15.0)), "w_m is clipped at 15 rad/s"),
        (record(i_q=np.clip(I, -0.8, 0.8), w_m=W), "i_q is clipped"),
        (record(i_q=I, theta_m=np.clip(2.0 * np.sin(9.0 * T), -1.5, 1.5)), "theta_m is clipped at 1.5 rad"),
        (record(i_q=np.where(T[300] == T, np.nan, I), w_m=W), "i_q is not a number at t = 0.3 s (1 samples)"),
        (record(i_q=np.roll(SHAKEN, 150), w_m=FOLLOWS), "w_m runs 0.15 s ahead of i_q: the channels are out of step"),
        (
            record(i_q=I, w_m=W, theta_m=np.cumsum(W) * 1e-3 / 9.55),
            "theta_m changes 0.105 times as fast as w_m [rad/s]",
        ),
        (Record((Cycle(0, {"t": T[:20], "i_q": I[:20], "w_m": W[:20]}),)), "too short"),
    ],
)
def test_what_is_missing_is_said(measured, said):
    with pytest.raises(RecordError) as caught:
        AxisPlant(PLANT, [measured])
    assert said in str(caught.value)


def test_a_place_where_the_axis_rests_is_no_limit_of_its_encoder():
    there = there_and_back()
    assert np.mean(there == there.max()) > 0.1
    AxisPlant(PLANT, [record(i_q=I, theta_m=there)])
