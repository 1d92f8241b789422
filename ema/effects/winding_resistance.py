"""Winding resistance: copper warms, contacts age; hidden by the current control until the voltage limit."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_REVERSED, Effect, Parameter
from .search import AxisSizes, Look, Span


def factor(dT, change, per_kelvin):
    """R × (1 + δ + α ΔT)"""
    return 1.0 + change + per_kelvin * dT


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if not s.shows_voltage or "R" in s.fitted:
        return None
    change = {"change": Span(-0.6, 2.0, (0.05,), 0.05)}
    return {**change, "per_kelvin": Span(0.0, 0.008, (0.0039,), 0.001)} if s.warms else change


EFFECT = Effect(
    name="winding_resistance",
    parameters=(
        Parameter("change", "1", 0.0, -0.3, 1.0, 0.1, "relative change of resistance at 20 °C"),
        Parameter("per_kelvin", "1/K", 0.0, 0.0, 0.006, 0.0039, "relative change per kelvin above 20 °C"),
    ),
    sentence="winding resistance changed",
    besides={"change": " by {change:+z.1%}", "per_kelvin": " by {per_kelvin:+z.2%} per kelvin above 20 °C"},
    separated_by="phase voltage at known current, or a motion at the voltage limit",
    laws={"resistance_factor": factor},
    plants=("ema", "axis"),
    limits={"change": NOT_REVERSED},
    looks=(
        Look("change"),
        Look("per_kelvin", needs="warming"),
        Look("change", "per_kelvin", needs="warming"),
    ),
    on_axis=on_axis,
)
