"""Inverter drop: dead time and the switches' own voltage act against the current's direction.

Where the current's ripple crosses zero within a switching period, both directions share the period: the drop falls with
the mean current there, in proportion for a triangular ripple; capacitances of the switches round the corner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from numba import njit

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Span


@njit(inline="always")
def drop(i, voltage, below, roundness):
    """Voltage lost to current i, from a straight rise to a corner (roundness 0) to a hyperbolic tangent (1).   [V]"""
    x = i / max(below, 1e-6)
    corner = min(max(x, -1.0), 1.0)
    return voltage * (corner + roundness * (math.tanh(x) - corner))


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if not s.shows_voltage:
        return None
    return {
        "voltage": Span(0.0, 0.5 * s.voltage, (0.02 * s.voltage,), 0.01 * s.voltage),
        "below": Span(0.0, s.current, (0.01 * s.current, 0.2 * s.current), 0.05 * s.current),
        "roundness": Span(0.0, 1.0, (0.5,), 0.5),
    }


EFFECT = Effect(
    name="inverter_drop",
    parameters=(
        Parameter("voltage", "V", 0.0, 0.0, 5.0, 0.05, "voltage lost against the current's direction"),
        Parameter("below", "A", 0.01, 0.0, 5.0, 0.1, "current below which it fades (ripple)"),
        Parameter("roundness", "1", 0.0, 0.0, 1.0, 0.5, "0: fades in a straight line, 1: as a hyperbolic tangent"),
    ),
    sentence="the inverter loses {voltage:.3g} V against the current's direction (dead time, switches)",
    besides={"below": ", less below {below:.2g} A"},
    separated_by="voltage at the motor's terminals; standstill at several small currents",
    plants=("axis",),
    limits={"below": NOT_NEGATIVE},
    on_axis=on_axis,
)
