"""Effects that are tried where the balance of torque shows their law, begun where the regression found them.

What no axis without them shows needs no place in the search of every record: each candidate more is one more that
noise may favour.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry

from .balance.as_effects import effects

if TYPE_CHECKING:
    from .plant import AxisPlant

SCREENED = (
    *("viscous_by_direction", "pendulum", "output_load_friction", "drive_unequal", "viscous_slope", "friction_slope"),
)
ROOM = 10.0  # times the size that the regression found, to which a fit may go
FIXED = ("centre",)


def screened(plant: AxisPlant, point: Point) -> list[Candidate]:
    """Candidates for the laws that the balance needs."""
    balance = plant.balance
    if balance is None:
        return []
    have = {name.split(".")[0] for name in point} | set(plant.plant.effects)
    out = []
    for term in balance.terms:
        for name, values in effects(balance, term).items():
            if name in SCREENED and name not in have:
                out.append(_candidate(name, values))
    return out


def _candidate(name: str, values: dict[str, float]) -> Candidate:
    effect = registry()[name]
    free = []
    for p in effect.parameters:
        value = values[p.name]
        if p.name in FIXED:
            continue
        if p.name == "phase":
            free.append(Free(f"{name}.{p.name}", p.unit, value - np.pi, value + np.pi, value, 0.1))
        else:
            low = 0.0 if p.low == 0.0 else -ROOM * abs(value)
            free.append(Free(f"{name}.{p.name}", p.unit, low, ROOM * abs(value), value, 0.1 * abs(value)))
    start = {f"{name}.{key}": value for key, value in values.items()}
    return Candidate(name, name, tuple(free), (start,), {free[0].name: effect.neutral()[effect.parameters[0].name]})
