"""A gear that gives: where its resonance lies is looked for before anything is fitted, a fit would not find it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.fitting import log_likelihood, scale_of
from ema.discrepancy.plant import Candidate, Free, Point
from ema.effects import registry

if TYPE_CHECKING:
    from .measured import Measured

NAME = "gear_compliance"
SHARES = (0.35, 0.65)  # of the inertia, behind the gear
FREQUENCIES = 24
LOWEST, HIGHEST = 3.0, 0.2  # [Hz], and per sample: of the load against a motor that is held
DAMPING = 0.1
RUBS = (0.0, 0.5)  # share of the dry friction behind the gear: it holds a twist at rest, and lets it go late


def gear_candidate(plant: Measured, point: Point, blocks: Sequence[int]) -> Candidate | None:
    """The likeliest resonance as a start, or None where the record shows no motion that could show one."""
    if any(name.startswith(NAME) for name in point):
        return None
    moving = [j for j in blocks if not plant.windows[j].static]
    if not moving or plant.plant.drive == "speed-loop":
        return None
    period = max(plant.windows[j].period for j in moving)
    J, F = plant.plant.inertia, max(point.get("F_d", plant.plant.F_d), 0.0)
    starts = [
        _start(share * J, 1.0 / ((2.0 * np.pi * f) ** 2 * share * J), behind * F, (1.0 - behind) * F)
        for f in np.geomspace(LOWEST, max(HIGHEST / period, 2.0 * LOWEST), FREQUENCIES)
        for share in SHARES
        for behind in (RUBS if F > 0.0 else RUBS[:1])
    ]
    runs = plant.residuals([{**point, **start} for start in starts], moving)
    scale = min(scale_of(r) for r in runs)
    best = starts[int(np.argmax([sum(s.sum() for s in log_likelihood(r, scale)) for r in runs]))]
    units = {p.name: p.unit for p in registry()[NAME].parameters}
    c, J_l = best[f"{NAME}.compliance"], best[f"{NAME}.inertia"]
    free = (
        Free(f"{NAME}.compliance", units["compliance"], 0.0, 30.0 * c, c, 0.03 * c),
        Free(f"{NAME}.inertia", units["inertia"], 0.01 * J, 0.97 * J, J_l, 0.03 * J),
        Free(f"{NAME}.damping", units["damping"], 0.0, 1.0, DAMPING, 0.02),
        *([Free(f"{NAME}.friction", units["friction"], 0.0, 2.0 * F, 0.0, 0.05 * F)] if F > 0.0 else []),
    )
    return Candidate(NAME, NAME, free, (best,), {f"{NAME}.compliance": 0.0})


def _start(J_l: float, c: float, F_l: float, F: float) -> dict[str, float]:
    own = {"compliance": float(c), "inertia": float(J_l), "damping": DAMPING, "friction": F_l}
    return {**{f"{NAME}.{name}": value for name, value in own.items()}, "F_d": F}
