"""How far the zeros of rotor and user lie apart, where the record alone leaves it open: beside a model it is told.

A gear that gives and a late sensor let the gap between rotor and user vary. A model with them says how it does, and
what is left of its mean lies between the zeros. A load that bends the gear shifts the mean too: told again once that
has been found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.actuator.reading.zeros import SEEN
from ema.discrepancy.plant import Point

from .fit import SEED

if TYPE_CHECKING:
    from ema.discrepancy.actuator.simulating.plant import EmaPlant


def find_zero(plant: EmaPlant, point: Point, cycles: Sequence[int]) -> float | None:
    """θ_m/GR less θ_u in the middle of the play, beside what `point` says; None where it is as it is taken. [rad]"""
    if not plant.leaves_zero_open:
        return None
    GR, signals = plant.plant.transmission.GR, plant.data.signals
    of_rotor = float(plant.zero_error([point])[0]) / GR
    off = []
    for c in cycles:
        made, _ = plant.signals([point], [c], [SEED + 1000 * c], plant.steps[0])
        gap = signals[c].theta_m[0] / GR - signals[c].theta_u[0]
        off.append(float(np.mean(gap - (made.theta_m[0] / GR - made.theta_u[0]))))
    zero = float(np.mean(off)) + of_rotor
    taken = of_rotor if plant.data.zero is None else plant.data.zero
    return zero if abs(zero - taken) > SEEN else None


def take_zero(plant: EmaPlant, zero: float | None) -> None:
    """Simulate with zeros that lie so far apart from now on; None: open, and the user's sensor is right."""
    plant.data = replace(plant.data, zero=zero)
