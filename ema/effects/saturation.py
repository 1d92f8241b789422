"""Magnetic saturation: torque constant and inductance fall with phase current."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Look, Span


def emf_factor(i_j, dT, emf, inductance, per_ampere, inductance_per_ampere):
    """κ × 1 / (1 + α |i| + β i²): iron that gives way from the first ampere on, or later."""
    return 1.0 / (1.0 + abs(i_j) * (per_ampere + emf * abs(i_j)))


def inductance_factor(i_j, emf, inductance, per_ampere, inductance_per_ampere):
    """L × 1 / (1 + δ |i| + γ i²)"""
    return 1.0 / (1.0 + abs(i_j) * (inductance_per_ampere + inductance * abs(i_j)))


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if s.is_force:
        return None
    return {
        "emf": Span(0.0, 0.3 / s.current**2, (0.03 / s.current**2,), 0.02 / s.current**2),
        "per_ampere": Span(0.0, 0.3 / s.current, (0.01 / s.current,), 0.02 / s.current),
    }


EFFECT = Effect(
    name="saturation",
    parameters=(
        Parameter("emf", "1/A^2", 0.0, 0.0, 0.005, 0.0004, "relative loss of torque constant per current squared"),
        Parameter("inductance", "1/A^2", 0.0, 0.0, 0.01, 0.001, "relative loss of inductance per current squared"),
        Parameter("per_ampere", "1/A", 0.0, 0.0, 0.05, 0.004, "relative loss of torque constant per current"),
        Parameter("inductance_per_ampere", "1/A", 0.0, 0.0, 0.1, 0.008, "relative loss of inductance per current"),
    ),
    sentence="magnetic saturation:",
    besides={
        "emf": " the torque constant falls by {emf:.2g} per A²",
        "per_ampere": " the torque constant falls by {per_ampere:.2g} per A",
        "inductance": " the inductance falls by {inductance:.2g} per A²",
        "inductance_per_ampere": " the inductance falls by {inductance_per_ampere:.2g} per A",
    },
    separated_by="motions with high and low acceleration",
    laws={"emf_factor": emf_factor, "inductance_factor": inductance_factor},
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema", "axis"),
    limits=dict.fromkeys(("emf", "inductance", "per_ampere", "inductance_per_ampere"), NOT_NEGATIVE),
    looks=(Look("emf", "inductance"), Look("per_ampere", "inductance_per_ampere")),
    on_axis=on_axis,
)
