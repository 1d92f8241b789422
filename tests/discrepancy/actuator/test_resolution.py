"""In what steps a channel was recorded, through few decimals too."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.actuator.reading.resolution import resolution

COURSE = 0.3 * np.sin(np.linspace(0.0, 20.0, 3000))


@pytest.mark.parametrize("step", [9.6e-5, 2e-3])
def test_steps_are_found_though_decimals_are_few(step):
    assert resolution(np.round(step * np.round(COURSE / step), 6)) == pytest.approx(step, rel=1e-3)


def test_a_smooth_channel_and_a_constant_one_have_none():
    assert resolution(COURSE) == 0.0
    assert resolution(np.full(100, 48.0)) == 0.0
