"""What is left after the faults is said to come and go where it does, and only there."""

from __future__ import annotations

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.fitting.search import Search
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.actuator.telling.repeating import describe, repeating


@pytest.mark.parametrize(
    ("flaws", "repeats"),
    [
        ({"drag": 0.012}, False),
        ({"weak_leg": 0.05}, False),
        ({"viscous": 6e-5}, True),
        ({"line": 0.01}, True),
        ({}, None),
    ],
    ids=["intermittent drag", "a leg that misses commands", "drag", "torque line", "nothing"],
)
def test_what_does_not_repeat_is_told(hidden, shipped_plant, flaws, repeats):
    cycles = hidden.cycles(hidden.Flaws(**flaws), 4, 7, motions=(hidden.chirp(),))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data)
    share = repeating(Search(plant, Noise(plant, {}), *split(data)), {})
    assert (share is None) is (repeats is None)
    assert bool(describe(share)) is (repeats is False)
