"""Dry friction that drifts within a cycle: grease that warms up or is pushed away, where no temperature is recorded."""

from __future__ import annotations

from .base import Effect, Parameter


def factor(t, dT, rate, since):
    """F × max(1 + r (t - t_0), 0)"""
    return max(1.0 + rate * (t - since), 0.0)


EFFECT = Effect(
    name="friction_drift",
    parameters=(
        Parameter("rate", "1/s", 0.0, -10.0, 10.0, -0.05, "growth of dry friction with time, over nominal friction"),
        Parameter("since", "s", 0.0, -1e6, 1e6, 0.0, "time of a cycle at which friction is the plant file's"),
    ),
    sentence="dry friction drifts within a cycle by {rate} per second",
    separated_by="the same motion cold and warm, with a temperature recorded",
    laws={"drifting_friction": factor},
    mistaken_for=("k1",),
    plants=("axis",),
)
