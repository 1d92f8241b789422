"""Inertia by angle: a crank, a linkage or an eccentric load moves more mass at some angles of a turn than at others."""

from __future__ import annotations

from collections.abc import Mapping

from .base import SHARE, Effect, Parameter
from .search import AxisSizes, Span
from .vector_math import cos, sin


def share(theta_m, once_cosine, once_sine, twice_cosine, twice_sine):
    """Δ(θ) = c₁ cos θ + s₁ sin θ + c₂ cos 2θ + s₂ sin 2θ   of the inertia J [1 + Δ(θ)]"""
    c, s = cos(theta_m), sin(theta_m)
    return once_cosine * c + once_sine * s + twice_cosine * (c * c - s * s) + twice_sine * (2.0 * s * c)


def slope(theta_m, once_cosine, once_sine, twice_cosine, twice_sine):
    """dΔ/dθ = -c₁ sin θ + s₁ cos θ - 2 c₂ sin 2θ + 2 s₂ cos 2θ   [1/rad]"""
    c, s = cos(theta_m), sin(theta_m)
    once = once_sine * c - once_cosine * s
    return once + 2.0 * (twice_sine * (c * c - s * s) - twice_cosine * (2.0 * s * c))


PARTS = ("once_cosine", "once_sine", "twice_cosine", "twice_sine")


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins: of an axis that turns."""
    return dict.fromkeys(PARTS, Span(-0.9, 0.9, (0.01,), 0.03)) if s.turns and s.moves else None


EFFECT = Effect(
    name="inertia_by_angle",
    parameters=(
        Parameter("once_cosine", "1", 0.0, -0.9, 0.9, 0.1, "cosine part once per turn, of the inertia"),
        Parameter("once_sine", "1", 0.0, -0.9, 0.9, 0.1, "sine part once per turn, of the inertia"),
        Parameter("twice_cosine", "1", 0.0, -0.9, 0.9, 0.1, "cosine part twice per turn, of the inertia"),
        Parameter("twice_sine", "1", 0.0, -0.9, 0.9, 0.1, "sine part twice per turn, of the inertia"),
    ),
    sentence="the inertia changes with the angle: once ({once_cosine:+.2g}, {once_sine:+.2g}) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} of it) per turn, as with a crank or a linkage",
    separated_by="turns run out without a drive, and slow turns, in which it does nothing",
    laws={"inertia_share": share, "inertia_slope": slope},
    limits=dict.fromkeys(PARTS, SHARE),
    plants=("axis",),
    on_axis=on_axis,
)
