"""Load-dependent friction: gear meshes lose a share of the torque they pass on."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Look, Span


def factor(theta_m, w_m, theta_u, direction, tau_load, per_torque):
    """F × (1 + c |τ_m|), with τ_m the torque of the motor"""
    return 1.0 + per_torque * abs(tau_load)


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    return {"per_torque": Span(0.0, 20.0 / s.torque, (0.2 / s.torque,), 0.1 / s.torque)}


EFFECT = Effect(
    name="load_friction",
    parameters=(
        Parameter(
            "per_torque", "1/(N m)", 0.0, 0.0, 20.0, 1.0, "growth of friction per motor torque, over nominal friction"
        ),
    ),
    sentence="friction grows with the torque passed on, by {per_torque} per N m",
    separated_by="motions with different accelerations or loads at the same speed",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"per_torque": NOT_NEGATIVE},
    looks=(Look("per_torque"),),
    on_axis=on_axis,
)
