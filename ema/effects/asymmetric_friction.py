"""Direction-dependent friction: more friction one way than the other (seals, preloaded gears)."""

from __future__ import annotations

from collections.abc import Mapping

from .base import SHARE, Effect, Parameter
from .search import AxisSizes, Look, Span


def factor(theta_m, w_m, theta_u, direction, tau_load, asymmetry):
    """F × (1 + a sign ω_m)"""
    return 1.0 + asymmetry * direction


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    return {"asymmetry": Span(-0.95, 0.95, (0.1,), 0.05)}


EFFECT = Effect(
    name="asymmetric_friction",
    parameters=(
        Parameter(
            "asymmetry", "1", 0.0, -0.8, 0.8, 0.1, "half difference of friction between the directions over its mean"
        ),
    ),
    sentence="friction differs by direction: {asymmetry} in positive, the opposite in negative",
    separated_by="slow motion in both directions, without load at the user",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"asymmetry": SHARE},
    looks=(Look("asymmetry"),),
    on_axis=on_axis,
)
