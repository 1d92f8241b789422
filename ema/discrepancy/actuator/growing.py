"""Faults that grow while a record is made: the simulation may be right in every cycle, with faults of its own.

Cycles of one motion differ by chance alone if nothing changes between them; no effect of the library makes them differ,
but for those of temperature. Where they differ by more, and with faults of each cycle they do not, these are no flaw.
What all cycles leave alike is looked into beside them; faults of each have taken what they could of it, so they are
found anew beside every effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ema.core.names import FAULTS

from .candidates import WARMER
from .features import Array
from .fit import K_FREE, N_SEEDS, Fit, fit, residuals
from .select import Model, Search

DIFFER = 1.5  # times what noise makes of the differences between cycles of one motion
TOLD = 0.01  # range of a fault from which it is said to change


def growing(search: Search, model: Model) -> Array | None:
    """Faults of each cycle, shape (n_cycles, 6), if these explain what cycles of one motion differ by."""
    data, cycles = search.plant.data, range(search.plant.data.n_cycles)
    left = residuals(search.plant, search.noise, model.fit.point, cycles, N_SEEDS)
    if np.ptp(data.dT) > WARMER or _differ(search, left) < DIFFER:
        return None
    search.say("cycles of one motion differ: faults of each")
    fits = [_of_one(search, model, c) for c in cycles]
    left = {c: fitted.residuals[c] for c, fitted in zip(cycles, fits, strict=True)}
    return _faults(search, fits) if _differ(search, left) < DIFFER else None


def beside(search: Search, model: Model) -> Array:
    """Faults of each cycle beside the effects of `model`, shape (n_cycles, 6)."""
    return _faults(search, [_of_one(search, model, c) for c in range(search.plant.data.n_cycles)])


def _of_one(search: Search, model: Model, cycle: int) -> Fit:
    """Faults of one cycle, with the columns of its motion."""
    motion = int(search.plant.data.motion[cycle])
    known = {key: column for key, column in model.fit.columns.items() if key[0] == motion}
    return fit(search.plant, search.noise, K_FREE, model.fit.point, [cycle], known=known, n_iterations=5)


def _faults(search: Search, fits: Sequence[Fit]) -> Array:
    found = np.array([[fitted.point.get(name, 0.0) for name in FAULTS] for fitted in fits])
    return np.clip(search.plant.data.faults + found, 0.0, 1.0)


def said(faults: Array) -> str:
    """The sentence for faults of each cycle, shape (n_cycles, 6)."""
    ranges = [
        f"{name} {low:.3f} to {high:.3f}"
        for name, low, high in zip(FAULTS, faults.min(axis=0), faults.max(axis=0), strict=True)
        if high - low > TOLD
    ]
    return f"faults change from cycle to cycle: {', '.join(ranges)}; what is told of them here is their mean"


def _differ(search: Search, left: Mapping[int, Array]) -> float:
    """Squared differences between cycles of one motion, over what noise makes of them; one where none is repeated."""
    found = expected = 0.0
    for motion in range(search.plant.n_motions):
        cycles: Sequence[int] = np.flatnonzero(search.plant.data.motion == motion).tolist()
        r = np.array([left[c] for c in cycles])
        found += float(((r - r.mean(axis=0)) ** 2).sum())
        each = float((search.noise.motions[motion].fresh ** 2).sum(axis=1).mean()) * (1.0 + 1.0 / N_SEEDS)
        expected += (len(cycles) - 1) * each
    return found / expected if expected else 1.0
