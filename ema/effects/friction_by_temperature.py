"""Dry friction that falls as the axis warms up: the shear strength of grease between seals, guides and gear teeth."""

from __future__ import annotations

from .base import Effect, Parameter
from .viscous_by_temperature import kept


def factor(t, dT, per_kelvin):
    """F × exp(-k ΔT)"""
    return kept(dT, per_kelvin)


EFFECT = Effect(
    name="friction_by_temperature",
    parameters=(
        Parameter("per_kelvin", "1/K", 0.0, -0.1, 0.1, 0.01, "share of dry friction lost per kelvin above 20 °C"),
    ),
    sentence="dry friction falls by {per_kelvin} per kelvin of the recorded temperature",
    separated_by="the same motion cold and warm, and once more after the axis has cooled down",
    laws={"drifting_friction": factor},
    mistaken_for=("k1",),
    plants=("axis",),
)
