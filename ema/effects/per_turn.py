"""What comes once and twice per turn of the rotor: error of an angle sensor, friction, inertia."""

from __future__ import annotations

from math import pi

from numba import njit

from .base import Parameter
from .search import AxisSizes, Span
from .vector_math import cos, sin

ORDERS = (1, 2)  # of each a cosine and a sine part
PARTS = ("once_cosine", "once_sine", "twice_cosine", "twice_sine")

LEAST_TRAVEL = pi  # [rad] that shows what comes once per turn apart from a parabola along the travel


def wave(theta_m, once_cosine, once_sine, twice_cosine, twice_sine):
    """c₁ cos θ + s₁ sin θ + c₂ cos 2θ + s₂ sin 2θ"""
    c, s = cos(theta_m), sin(theta_m)
    return once_cosine * c + once_sine * s + twice_cosine * (c * c - s * s) + twice_sine * (2.0 * s * c)


inlined_wave = njit(inline="always")(wave)  # within a law


def slope(theta_m, once_cosine, once_sine, twice_cosine, twice_sine):
    """d`wave`/dθ = -c₁ sin θ + s₁ cos θ - 2 c₂ sin 2θ + 2 s₂ cos 2θ"""
    c, s = cos(theta_m), sin(theta_m)
    once = once_sine * c - once_cosine * s
    return once + 2.0 * (twice_sine * (c * c - s * s) - twice_cosine * (2.0 * s * c))


def parameters(unit: str, of: str, most: float, start: float) -> tuple[Parameter, ...]:
    """The four of them, within ±`most`."""
    said = {name: name.replace("_", " per mechanical turn, ") for name in PARTS}
    return tuple(Parameter(name, unit, 0.0, -most, most, start, f"{of}, {said[name]} part") for name in PARTS)


def is_shown(s: AxisSizes) -> bool:
    """Whether an axis turns far enough to show what comes once per turn."""
    return s.turns and 2.0 * s.half_range > LEAST_TRAVEL


def spans(most: float, start: float, scale: float) -> dict[str, Span]:
    """Where an axis' records are searched for each of the four."""
    return dict.fromkeys(PARTS, Span(-most, most, (start,), scale))
