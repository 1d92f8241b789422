"""A gear that gives: where its resonance lies is looked for before anything is fitted, a fit would not find it.

Dry friction behind a gear holds a twist at rest, and lets it go late. Where the angle is measured behind the gear, the
motor is beyond it, and what rubs is mostly there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.fitting import rate
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

NAMES = {"motor": "gear_compliance", "load": "drive_compliance"}  # by where the angle is measured
SHARES = (0.35, 0.65)  # of the inertia, beyond the gear as seen from the sensor
FREQUENCIES = 24
# Of the load against a motor that is held: damping ratio, and natural frequencies, lowest [Hz] and highest per sample.
# One resonates; one creeps after the motor at a rate of 2 ζ ω, as behind rubber or a clutch that slips.
DAMPING, CREEPING = 0.1, 5.0
RANGES = {DAMPING: (3.0, 0.2), CREEPING: (0.05, 0.01)}
ROOM = 10.0  # times the damping ratio of the start, up to which a fit may go
RUBS = {"motor": (0.0, 0.5), "load": (1.0, 0.5)}  # share of the dry friction there


def gear_candidate(plant: Measured, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """The likeliest resonance as a start, or None where the record shows no motion that could show one."""
    side = plant.plant.measured_at
    effect = NAMES[side]
    if any(name.startswith(effect) for name in point):
        return None
    moving = [j for j in blocks if not plant.windows[j].static]
    if not moving or plant.plant.drive == "speed-loop":
        return None
    period = max(plant.windows[j].period for j in moving)
    J, F = point.get("J", plant.plant.inertia), max(point.get("F_d", plant.plant.F_d), 0.0)
    starts = [
        _start(effect, share * J, 1.0 / ((2.0 * np.pi * f) ** 2 * share * J), zeta, beyond * F, (1.0 - beyond) * F)
        for zeta, (lowest, highest) in RANGES.items()
        for f in np.geomspace(lowest, max(highest / period, 2.0 * lowest), FREQUENCIES)
        for share in SHARES
        for beyond in (RUBS[side] if F > 0.0 else (0.0,))
    ]
    runs = plant.residuals([{**point, **start} for start in starts], moving)
    best = starts[int(np.argmax(rate(runs)))]
    units = {p.name: p.unit for p in registry()[effect].parameters}
    c, J_b, zeta = (best[f"{effect}.{name}"] for name in ("compliance", "inertia", "damping"))
    free = (
        Free(f"{effect}.compliance", units["compliance"], 0.0, 30.0 * c, c, 0.03 * c),
        Free(f"{effect}.inertia", units["inertia"], 0.01 * J, 0.97 * J, J_b, 0.03 * J),
        Free(f"{effect}.damping", units["damping"], 0.0, ROOM * zeta, zeta, 0.2 * zeta),
        *([Free(f"{effect}.friction", units["friction"], 0.0, 2.0 * F, 0.0, 0.05 * F)] if F > 0.0 else []),
    )
    return Candidate(effect, effect, free, (best,))


def _start(effect: str, J_b: float, c: float, zeta: float, F_b: float, F: float) -> dict[str, float]:
    own = {"compliance": float(c), "inertia": float(J_b), "damping": zeta, "friction": F_b}
    return {**{f"{effect}.{name}": value for name, value in own.items()}, "F_d": F}
