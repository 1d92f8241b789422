"""Long records: as many cycles of each motion as an examination needs, spread from first to last."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .measured import Measured


MOST = 24  # cycles that are examined; with more, the library's own approximations are what is left
BY_CYCLE = ("motion", "start", "speed", "user_speed", "holding", "dT", "faults", "ranges")
AT_LEAST = 2  # of each motion: one to fit, one to judge


def choose_evenly(cycles: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """At most `n` of the cycles, from first to last."""
    return cycles[np.unique(np.linspace(0, len(cycles) - 1, n).round().astype(int))]


def thin(data: Measured, most: int = MOST) -> tuple[Measured, str | None]:
    """At most `most` of the cycles, alike of every motion, and what is said of it; all where there are no more."""
    if data.n_cycles <= most:
        return data, None
    of_motion = [np.flatnonzero(data.motion == m) for m in range(len(data.commands))]
    each = next(
        (n for n in range(most, AT_LEAST, -1) if sum(min(n, len(cycles)) for cycles in of_motion) <= most), AT_LEAST
    )
    kept = np.sort(np.concatenate([choose_evenly(cycles, each) for cycles in of_motion]))
    if len(kept) == data.n_cycles:
        return data, None
    told = f"{len(kept)} of {data.n_cycles} cycles were examined, spread over the records; --cycles chooses others"
    return _only(data, kept), told


def _only(data: Measured, kept: NDArray[np.int64]) -> Measured:
    """Some of the cycles."""
    arrays = {name: getattr(data, name)[kept] for name in BY_CYCLE}
    return replace(
        data,
        labels=tuple(data.labels[c] for c in kept),
        signals=[data.signals[c] for c in kept],
        y=[data.y[c] for c in kept],
        envelopes=[data.envelopes[c] for c in kept],
        **arrays,
    )
