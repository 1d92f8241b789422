"""Quadratic drag: a fan, an oil bath or air; a torque proportional to the speed squared."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Look, Span


def torque(theta_m, w_m, theta_u, i_q, coefficient):
    """τ = c |ω_m| ω_m   [N m]"""
    return coefficient * abs(w_m) * w_m


def on_axis(s: AxisSizes) -> Mapping[str, Span]:
    """Where a search begins, by what the records hold."""
    c = s.torque / s.speed**2
    return {"coefficient": Span(0.0, 3.0 * c, (0.05 * c,), 0.05 * c)}


EFFECT = Effect(
    name="quadratic_drag",
    parameters=(
        Parameter(
            "coefficient", "N m s^2/rad^2", 0.0, 0.0, 2e-05, 5e-07, "torque per speed squared at the motor shaft"
        ),
    ),
    sentence="drag growing with the square of speed, {coefficient:.3g} N m s²/rad²",
    separated_by="motions at high speed",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    looks=(Look("coefficient"),),
    on_axis=on_axis,
)
