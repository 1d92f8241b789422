"""Angle zeros of records as the balance sees them: by lines of torque that are fitted beside inertia and friction.

Which lines two records share is known before (`ema.discrepancy.axis.scanning.zeros`), from the residual of the plant
file's numbers; what these miss moves a line of many periods by more than its place is sure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.regressing.apart import by_record
from ema.discrepancy.axis.balance.regressing.regression import Plain, regress
from ema.discrepancy.axis.scanning.overlap import between

from .course import Course
from .integrated import integrate_rows

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured, Zero


def refine_zeros(plant: Measured, recorded: Sequence[Course], plain: Plain) -> dict[str, Zero]:
    """The zeros of the plant's records by the lines of the balance, where a zero was found to be off."""
    moved = {name: zero.orders for name, zero in plant.zeros.items() if zero.angle}
    raw = integrate_rows(plant, list(recorded)) if moved else None
    if raw is None:
        return plant.zeros
    names = raw.motion.records
    orders = sorted({n for own in moved.values() for n in own})
    keys = {f"line {n:.5g}": n for n in orders}
    lines = [by_record(law, len(names)) for law in laws(raw.motion, linear=False) if law.key in keys]
    fit = regress(raw, plain, lines, apart=True)
    parts = [fit.coefficients[fit.part(law)].reshape(-1, 2) for law in lines]
    seen = [keys[law.repeats.key] for law in lines if law.repeats is not None]
    z = {
        name: {n: complex(own[k, 0], -own[k, 1]) for n, own in zip(seen, parts, strict=True)}
        for k, name in enumerate(names)
    }
    reference = next(name for name in names if name not in plant.zeros)
    found = {
        name: between({n: z[reference][n] for n in own if n in z[reference]}, z[name]) for name, own in moved.items()
    }
    return {**plant.zeros, **{name: zero for name, zero in found.items() if zero.angle is not None}}


def add_zeros(plant: Measured, recorded: Sequence[Course]) -> list[Course]:
    """The courses with what is to be added to their angles."""
    angles = {name: zero.angle or 0.0 for name, zero in plant.zeros.items()}
    return [replace(c, zero=angles.get(c.record, 0.0)) for c in recorded]
