"""Whether what is left repeats from cycle to cycle of one motion, or comes and goes with time."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.actuator.fitting.fit import residuals
from ema.discrepancy.actuator.fitting.model import FINAL_SEED, N_FINAL
from ema.discrepancy.plant import Point

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

SELDOM = 0.8  # share that repeats, below which that is worth a sentence; what always acts alike has 0.98 and more
FEWEST = 2.0  # misfit from which chance does not decide it


def repeating(search: Search, point: Point) -> float | None:
    """Share of the squared residual beyond noise that all cycles of a motion have in common, by their products.

    None where there are no two cycles of one motion, or hardly anything is left.
    """
    data, noise = search.plant.data, search.noise
    cycles = sorted(search.train + search.heldout)
    left = residuals(search.plant, noise, point, cycles, N_FINAL, FINAL_SEED)
    common = own = 0.0
    for motion in range(search.plant.n_motions):
        alike = [c for c in cycles if data.motion[c] == motion]
        if len(alike) < 2 or noise.misfit([left[c] for c in alike], alike) < FEWEST:
            continue
        by_noise = noise.expected(alike[:1])
        common += len(alike) * float(np.mean([left[a] @ left[b] for a, b in combinations(alike, 2)]))
        own += sum(float(left[c] @ left[c]) - by_noise for c in alike)
    return common / own if own > 0.0 else None


def describe(share: float | None) -> list[str]:
    """One sentence, where most of the rest does not repeat."""
    if share is None or share > SELDOM:
        return []
    other = f"{1.0 - max(share, 0.0):.0%}"
    return [f"{other} of it differs from cycle to cycle of one motion: it comes and goes, or keeps no phase"]
