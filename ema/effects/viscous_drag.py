"""Viscous drag: cold grease; a torque proportional to speed."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Look, Span


def torque(theta_m, w_m, theta_u, i_q, coefficient):
    """τ = c ω_m   [N m]"""
    return coefficient * w_m


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    c = s.torque / s.speed
    return {"coefficient": Span(-s.damping, 3.0 * c, (0.05 * c,), 0.05 * c)}


EFFECT = Effect(
    name="viscous_drag",
    parameters=(
        Parameter(
            "coefficient", "N m s/rad", 0.0, -0.0001, 0.002, 5e-05, "additional viscous coefficient at the motor shaft"
        ),
    ),
    sentence="viscous drag higher by {coefficient:.3g} N m s/rad (cold or stiff grease)",
    separated_by="motions at several speeds, the same at another temperature",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    looks=(Look("coefficient"),),
    on_axis=on_axis,
)
