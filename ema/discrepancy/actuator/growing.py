"""Faults that grow while a record is made: the simulation may be right in every cycle, with faults of its own.

Cycles of one motion differ by chance alone if nothing changes between them; no effect of the library makes them differ,
but for those of temperature. Where they differ by more, and faults of each cycle explain that, these are no flaw.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.names import FAULTS

from .candidates import WARMER
from .features import Array
from .fit import K_FREE, N_SEEDS, fit, residuals
from .plant import Point
from .select import NEARLY, Model, Search

DIFFER = 1.5  # times what noise makes of the differences between cycles of one motion
TOLD = 0.01  # range of a fault from which it is said to change


def growing(search: Search, model: Model) -> Array | None:
    """Faults of each cycle less those of `model`, shape (n_cycles, 6), if such explain what cycles differ by."""
    data = search.plant.data
    cycles = list(range(data.n_cycles))
    if np.ptp(data.dT) > WARMER or _differ(search, model.fit.point) < DIFFER:
        return None
    search.say("cycles of one motion differ: faults of each")
    fits = [
        fit(search.plant, search.noise, K_FREE, model.fit.point, [c], known=_known(model, c, search), n_iterations=5)
        for c in cycles
    ]
    if search.noise.misfit([f.residuals[c] for f, c in zip(fits, cycles, strict=True)], cycles) > NEARLY:
        return None
    return np.array([[f.point[name] - model.fit.point[name] for name in FAULTS] for f in fits])


def said(faults: Array) -> str:
    """The sentence for faults of each cycle, shape (n_cycles, 6)."""
    ranges = [
        f"{name} {low:.3f} to {high:.3f}"
        for name, low, high in zip(FAULTS, faults.min(axis=0), faults.max(axis=0), strict=True)
        if high - low > TOLD
    ]
    return f"faults change from cycle to cycle: {', '.join(ranges)}; what is told of them here is their mean"


def _known(model: Model, cycle: int, search: Search) -> dict[tuple[int, str], Array]:
    """Columns of `model` for the motion of a cycle."""
    motion = int(search.plant.data.motion[cycle])
    return {key: column for key, column in model.fit.columns.items() if key[0] == motion}


def _differ(search: Search, point: Point) -> float:
    """Squared differences between cycles of one motion, over what noise makes of them; one where none is repeated."""
    data, noise = search.plant.data, search.noise
    left = residuals(search.plant, noise, point, range(data.n_cycles), N_SEEDS)
    found = expected = 0.0
    for motion in range(search.plant.n_motions):
        cycles: Sequence[int] = np.flatnonzero(data.motion == motion).tolist()
        r = np.array([left[c] for c in cycles])
        found += float(((r - r.mean(axis=0)) ** 2).sum())
        each = float((noise.motions[motion].fresh ** 2).sum(axis=1).mean()) * (1.0 + 1.0 / N_SEEDS)
        expected += (len(cycles) - 1) * each
    return found / expected if expected else 1.0
