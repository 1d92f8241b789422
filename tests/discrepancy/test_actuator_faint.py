"""What a test of the whole record takes for noise, and the score does not."""

from __future__ import annotations

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.cycles import prepare
from ema.discrepancy.actuator.examine import examine


@pytest.mark.slow
def test_a_clock_that_is_slow_by_half_a_thousandth_is_named_and_the_shorts_beside_it_are_true(hidden, shipped_plant):
    """It bends a short of 2 % by a tenth; half a second ends a quarter of a millisecond early, and no more."""
    cycles = hidden.cycles(hidden.Flaws(clock_skew=5e-4, k2=0.06, k4=0.02), 4, 11, (hidden.chirp(),))
    made = examine(shipped_plant, prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))]))
    assert made.verdict_before.is_noise
    assert made.findings.gain.k_before[3] < 0.019
    (found,) = made.findings.effects
    assert found.name == "clock_skew"
    assert found.confidence > 0.95
    assert found.parameters["shared"].value == pytest.approx(5e-4, rel=0.2)
    assert made.findings.gain.k_after == pytest.approx((0.0, 0.06, 0.0, 0.02, 0.0, 0.0), abs=5e-4)
