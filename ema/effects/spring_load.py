"""A spring at the user (aerodynamic hinge moment, return spring)."""

from __future__ import annotations

from .base import Effect, Look, Parameter


def opposing(theta_u, stiffness):
    """τ_u = K θ_u   [N m]"""
    return stiffness * theta_u


EFFECT = Effect(
    name="spring_load",
    parameters=(Parameter("stiffness", "N m/rad", 0.0, -5000.0, 20000.0, 1000.0, "torque at the user per position"),),
    sentence="a load at the user growing with position, {stiffness:.3g} N m/rad",
    separated_by="slow motion at several positions",
    laws={"user_torque": opposing},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    looks=(Look("stiffness"),),
)
