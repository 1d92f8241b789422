"""Commutation offset: the resolver's zero is turned against the magnets."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="commutation_offset",
    parameters=(Parameter("angle", "rad", 0.0, -0.3, 0.3, 0.03, "error of the rotor angle, electrical"),),
    sentence="the commutation angle is off by {angle:.2g} rad electrical (resolver zero)",
    separated_by="back-EMF at constant speed with the inverter off",
    mistaken_for=("k3", "k4", "k5", "k6"),
    plants=("ema",),
)
