"""Viscous drag: cold grease; a torque proportional to speed."""

from __future__ import annotations

from .base import Effect, Look, Parameter


def torque(theta_m, w_m, theta_u, i_q, coefficient):
    """τ = c ω_m   [N m]"""
    return coefficient * w_m


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
)
