"""Ranges in which a recorder keeps the currents of a cycle: its largest samples pile up where it cuts them off.

One range for all cycles is a converter's, and the effect `adc_saturation` tells it. Ranges that differ from cycle to
cycle, of a recorder that chooses its own, are conditions of the cycles and no flaw of the actuator.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array

from .features import Signals

LEAST = 10  # samples that make a top
CLEAR = 3.0  # standard deviations by which they outnumber those one step below: one smooth top in a thousand does


def range_of(signals: Signals, step: float) -> float:
    """Largest current that the cycle's recorder keeps, infinite where nothing shows one. [A]

    Parameters
    ----------
    signals : Signals
        Of one cycle.
    step : float
        Of the converter. [A]
    """
    i = np.abs(signals.i)
    top = float(i.max())
    at_top, below = (
        int(((i >= top - high * step) & (i < top - low * step)).sum()) for low, high in ((-1, 0.5), (0.5, 1.5))
    )
    return top if at_top >= LEAST and at_top > below + CLEAR * np.sqrt(at_top + below) else np.inf


def ranges(signals: Sequence[Signals], step: float) -> Array:
    """Range of each cycle's recorder where cycles differ in it, shape (n_cycles,), else infinite. [A]"""
    each = np.array([range_of(s, step) for s in signals])
    seen = each[np.isfinite(each)]
    return each if seen.size and np.ptp(seen) > step else np.full(len(each), np.inf)


def describe(ranges: Array) -> list[str]:
    """In words, for a reader of the findings."""
    seen = ranges[np.isfinite(ranges)]
    if not seen.size:
        return []
    return [f"the currents are clipped at {seen.min():.3g} to {seen.max():.3g} A, each cycle at its own: simulated so"]
