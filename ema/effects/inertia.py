"""Inertia (or mass) other than the plant file says."""

from __future__ import annotations

from collections.abc import Mapping

from .base import SOME_LEFT, Effect, Parameter
from .search import AxisSizes, Look, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if {"J", "M"} & s.fitted or not s.moves:
        return None
    return {"change": Span(-0.8, 4.0, (0.02,), 0.03)}


EFFECT = Effect(
    name="inertia",
    parameters=(Parameter("change", "1", 0.0, -0.8, 3.0, 0.05, "relative change of inertia or mass"),),
    sentence="the moving inertia differs by {change:+z.2%}",
    separated_by="weighing, or a known load that changes only the torque",
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema", "axis"),
    limits={"change": SOME_LEFT},
    looks=(Look("change"),),
    on_axis=on_axis,
)
