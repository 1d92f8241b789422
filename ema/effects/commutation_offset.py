"""Commutation offset: the zero by which the phases are commutated is turned against the magnets."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="commutation_offset",
    parameters=(
        Parameter("angle", "rad", 0.0, -0.3, 0.3, 0.03, "error of the commutation angle, electrical"),
        Parameter("apart", "rad", 0.0, -0.3, 0.3, 0.03, "the part of it that is not in the recorded rotor angle"),
    ),
    sentence="the commutation angle is off by {angle:.2g} rad electrical (resolver zero)",
    besides={"apart": ", by {apart:.2g} against the recorded rotor angle"},
    separated_by="back-EMF at constant speed with the inverter off",
    mistaken_for=("k3", "k4", "k5", "k6"),
    plants=("ema",),
    place="loop",
)
