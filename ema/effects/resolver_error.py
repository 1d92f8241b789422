"""Resolver error: the measured rotor angle wobbles once and twice per turn."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Look, Span
from .vector_math import cos, sin


def error(theta_m, once_cosine, once_sine, twice_cosine, twice_sine):
    """Δθ = c₁ cos θ_m + s₁ sin θ_m + c₂ cos 2θ_m + s₂ sin 2θ_m   [rad]"""
    c, s = cos(theta_m), sin(theta_m)
    return once_cosine * c + once_sine * s + twice_cosine * (c * c - s * s) + twice_sine * (2.0 * s * c)


PARTS = ("once_cosine", "once_sine", "twice_cosine", "twice_sine")


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    return dict.fromkeys(PARTS, Span(-0.2, 0.2, (1e-3,), 0.01)) if s.turns else None


EFFECT = Effect(
    name="resolver_error",
    parameters=(
        Parameter("once_cosine", "rad", 0.0, -0.1, 0.1, 0.01, "cosine part of the error once per mechanical turn"),
        Parameter("once_sine", "rad", 0.0, -0.1, 0.1, 0.01, "sine part of the error once per mechanical turn"),
        Parameter("twice_cosine", "rad", 0.0, -0.1, 0.1, 0.01, "cosine part of the error twice per mechanical turn"),
        Parameter("twice_sine", "rad", 0.0, -0.1, 0.1, 0.01, "sine part of the error twice per mechanical turn"),
    ),
    sentence="the resolver errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn",
    separated_by="constant speed over many turns",
    laws={"angle_error": error},
    mistaken_for=("k6",),
    plants=("ema", "axis"),
    place="loop",
    looks=(Look("once_cosine", "once_sine", "twice_cosine", "twice_sine"),),
    on_axis=on_axis,
)
