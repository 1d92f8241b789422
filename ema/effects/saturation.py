"""Magnetic saturation: torque constant and inductance fall with phase current."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Look, Span


def emf_factor(i_j, dT, emf, inductance):
    """κ × 1 / (1 + β i²)"""
    return 1.0 / (1.0 + emf * i_j * i_j)


def inductance_factor(i_j, emf, inductance):
    """L × 1 / (1 + γ i²)"""
    return 1.0 / (1.0 + inductance * i_j * i_j)


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if s.is_force:
        return None
    return {"emf": Span(0.0, 0.3 / s.current**2, (0.03 / s.current**2,), 0.02 / s.current**2)}


EFFECT = Effect(
    name="saturation",
    parameters=(
        Parameter("emf", "1/A^2", 0.0, 0.0, 0.005, 0.0004, "relative loss of torque constant per current squared"),
        Parameter("inductance", "1/A^2", 0.0, 0.0, 0.01, 0.001, "relative loss of inductance per current squared"),
    ),
    sentence="magnetic saturation: the torque constant falls by {emf:.2g} per A², "
    "the inductance by {inductance:.2g} per A²",
    separated_by="motions with high and low acceleration",
    laws={"emf_factor": emf_factor, "inductance_factor": inductance_factor},
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema", "axis"),
    limits={"emf": NOT_NEGATIVE, "inductance": NOT_NEGATIVE},
    looks=(Look("emf", "inductance"),),
    on_axis=on_axis,
)
