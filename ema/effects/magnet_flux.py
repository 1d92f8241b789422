"""Magnet flux: back-EMF and torque constant scale with the magnets' flux, which falls with temperature."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_REVERSED, Effect, Parameter
from .search import AxisSizes, Look, Span


def emf_factor(i_j, dT, change, per_kelvin):
    """κ × (1 + δ + α ΔT)"""
    return 1.0 + change + per_kelvin * dT


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if s.is_force:
        return None
    change = {"change": Span(-0.4, 0.4, (-0.02,), 0.02)}
    return {**change, "per_kelvin": Span(-0.004, 0.002, (-0.001,), 0.0005)} if s.warms else change


EFFECT = Effect(
    name="magnet_flux",
    parameters=(
        Parameter("change", "1", 0.0, -0.3, 0.1, -0.02, "relative change of flux at 20 °C"),
        Parameter(
            "per_kelvin",
            "1/K",
            0.0,
            -0.002,
            0.0005,
            -0.001,
            "relative change of flux per kelvin of winding temperature above 20 °C",
        ),
    ),
    sentence="magnet flux changed",
    besides={"change": " by {change:+z.1%}", "per_kelvin": " by {per_kelvin:+z.2%} per kelvin above 20 °C"},
    separated_by="the same motion at another temperature; voltage at known speed",
    laws={"emf_factor": emf_factor},
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema", "axis"),
    limits={"change": NOT_REVERSED},
    looks=(
        Look("change"),
        Look("per_kelvin", needs="warming"),
        Look("change", "per_kelvin", needs="warming"),
    ),
    on_axis=on_axis,
)
