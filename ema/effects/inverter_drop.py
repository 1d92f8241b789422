"""Inverter drop: dead time and the switches' own voltage act against the current's direction."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="inverter_drop",
    parameters=(Parameter("voltage", "V", 0.0, 0.0, 5.0, 0.05, "voltage lost against the current's direction"),),
    sentence="the inverter loses {voltage:.3g} V against the current's direction (dead time, switches)",
    separated_by="voltage at the motor's terminals; standstill at several small currents",
    plants=("axis",),
)
