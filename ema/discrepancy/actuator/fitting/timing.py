"""By how many samples the recorded command is apart from the other channels: a condition of the record.

A recorder that writes the state at the end of a control period beside the command of its beginning has the command a
sample late. Nothing in the actuator is, but 0.1 ms are a current of 0.1 A, and faults would be fitted to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ema.discrepancy.plant import Point

from .fit import excess_at

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.noise import Noise
    from ema.discrepancy.actuator.simulating.plant import EmaPlant

TRIED = (-2, -1, 1, 2)  # samples
CLEAR = 0.1  # share of what is left that a shift may leave; a sensor's delay, which looks alike, leaves more


def find_samples_late(plant: EmaPlant, noise: Noise, point: Point, cycles: Sequence[int]) -> int:
    """Samples by which the command is late, 0 unless that takes nearly all that `point` leaves."""
    here = plant.late

    def excess(late: int) -> float:
        plant.late = late
        return excess_at(plant, noise, point, cycles)

    try:
        now, left = excess(here), {late: excess(late) for late in TRIED}
    finally:
        plant.late = here
    best = min(left, key=lambda late: left[late])
    return best if left[best] < CLEAR * now else 0
