"""Angle zeros of records that are given together: an encoder may count from another angle each time it is switched on.

A torque locked to the rotor, Re Σ z_n exp(i n θ), is the same in every record; seen from another zero, θ = θ_r + δ, its
lines are z_n exp(i n δ). δ is where they lie over each other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .cogging import integer_orders, scan
from .overlap import between
from .weak_form import FEWEST, weak_form

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured, Zero


def zeros(plant: Measured) -> dict[str, Zero]:
    """By record, beside the first one that shows such a torque; empty for one record or a linear axis."""
    if len(plant.benches) < 2 or plant.plant.is_linear:
        return {}
    lines = {b.name: _lines(plant, b.name) for b in plant.benches if b.roles.position is not None}
    if not lines:
        return {}
    first = next((name for name, own in lines.items() if own), next(iter(lines)))
    return {name: between(lines[first], own) for name, own in lines.items() if name != first}


def _lines(plant: Measured, name: str) -> dict[float, complex]:
    """z_n by order. [N m]"""
    weak = weak_form(plant, {}, [j for j, w in enumerate(plant.windows) if w.group == name])
    orders = integer_orders(weak)
    if len(orders) == 0 or len(weak.y) < FEWEST:
        return {}
    found = scan(weak, orders)
    return {n: complex(c, -s) for n, (c, s) in zip(found.orders, found.parts, strict=True)}
