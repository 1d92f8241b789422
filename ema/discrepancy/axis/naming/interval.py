"""Intervals of what was drawn from an answer's uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array

INTERVAL = (2.5, 97.5)  # percent


def interval(name: str, value: float, drawn: Sequence[float] | Array) -> tuple[float, float]:
    """Interval of 95 % of what was `drawn` for a parameter; of a phase about its `value`, within half a turn."""
    spread = np.asarray(drawn)
    if name.startswith("phase"):
        spread = value + np.angle(np.exp(1j * (spread - value)))
    low, high = np.percentile(spread, INTERVAL)
    return float(low), float(high)
