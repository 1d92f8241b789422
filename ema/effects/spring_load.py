"""A spring at the user (aerodynamic hinge moment, return spring)."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Look, Span


def opposing(theta_u, stiffness):
    """τ_u = K θ_u   [N m]"""
    return stiffness * theta_u


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    k = s.torque / s.half_range  # near a resonance it moves farther than the drive could hold it
    return {"stiffness": Span(-50.0 * k, 50.0 * k, (0.05 * k, 2.0 * k), 0.05 * k)}


EFFECT = Effect(
    name="spring_load",
    parameters=(Parameter("stiffness", "N m/rad", 0.0, -5000.0, 20000.0, 1000.0, "torque at the user per position"),),
    sentence="a load at the user growing with position, {stiffness:.3g} N m/rad",
    separated_by="slow motion at several positions",
    laws={"user_torque": opposing},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    looks=(Look("stiffness"),),
    on_axis=on_axis,
)
