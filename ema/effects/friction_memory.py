"""Friction with memory: bristles, or a preloaded gear, give way by some angle before they slide (LuGre).

    δ ds/dt = ω - |ω| s                        s in -1…1: share of dry friction that is built up
    τ_f     = F s + 2 ζ √(F J/δ) δ ds/dt       F: dry friction as the other laws have it, Stribeck's fall included

Why this one: Dahl's model is LuGre's without Stribeck and without damping, and its bristles ring on a small inertia;
LuGre takes F(ω) from the laws that are there and adds one number that records show, the angle δ. Generalised Maxwell
slip describes hysteresis loops within loops (non-local memory) too, by two numbers for each of four elements and more;
motion that comes to rest somewhere, as an actuator's does, does not show these.

Stiffness is F/δ. Where a step of the simulation is too long for that spring, friction is the four-state rule's.

References
----------
Canudas de Wit, Olsson, Åström and Lischinsky, "A new model for control of systems with friction", IEEE Transactions on
Automatic Control 40, 1995, doi:10.1109/9.376053.
Al-Bender, Lampaert and Swevers, "The generalized Maxwell-slip model", the same 50, 2005, doi:10.1109/TAC.2005.858676.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from numba import njit

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Span


@njit(inline="always")
def built_up(s, way, deflection):
    """Share of friction after a way [rad], exactly: s → ±1 over δ."""
    side = 1.0 if way > 0.0 else -1.0
    return side + (s - side) * math.exp(-abs(way) / deflection)


@njit(inline="always")
def torque(s, w, F, deflection, damping, inertia):
    """F s + 2 ζ √(F J/δ) (ω - |ω| s)   [N m]"""
    return F * s + 2.0 * damping * math.sqrt(F * inertia / deflection) * (w - abs(w) * s)


@njit(inline="always")
def is_slow(F, deflection, inertia, h):
    """Whether steps of `h` can follow the bristles: half a radian of their oscillation at most."""
    return deflection > 0.0 and h * h * F < 0.25 * deflection * inertia


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Over some share of the way between two reversals, and no longer than half of it."""
    if not s.moves:
        return None
    way = s.half_range
    return {
        "deflection": Span(0.0, 0.5 * way, (0.002 * way, 0.02 * way, 0.1 * way), 0.01 * way),
        "damping": Span(0.0, 2.0, (0.1,), 0.1),
    }


EFFECT = Effect(
    name="friction_memory",
    parameters=(
        Parameter("deflection", "rad", 0.0, 0.0, 1e4, 0.01, "angle over which friction builds up after a reversal"),
        Parameter("damping", "1", 0.1, 0.0, 2.0, 0.1, "damping ratio of the inertia on its bristles"),
    ),
    sentence="friction has a memory: after a reversal it builds up over {deflection:.3g} rad (presliding)",
    separated_by="small reversing motions of several amplitudes at several frequencies: memory knows the way only",
    mistaken_for=("k1", "k2"),
    plants=("axis",),
    on_axis=on_axis,
    acts_at_rest=True,
    limits={"deflection": NOT_NEGATIVE, "damping": NOT_NEGATIVE},
)
