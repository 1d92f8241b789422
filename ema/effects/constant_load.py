"""A constant torque at the user (weight, trim load)."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Look, Span


def opposing(theta_u, torque):
    """τ_u = T   [N m]"""
    return torque


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    return {"torque": Span(-3.0 * s.torque, 3.0 * s.torque, (0.02 * s.torque,), 0.02 * s.torque)}


EFFECT = Effect(
    name="constant_load",
    parameters=(Parameter("torque", "N m", 0.0, -60.0, 60.0, 3.0, "torque at the user, opposing positive motion"),),
    sentence="a constant load of {torque:.3g} N m at the user",
    separated_by="standstill or slow motion at several positions",
    laws={"user_torque": opposing},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    looks=(Look("torque"),),
    on_axis=on_axis,
)
