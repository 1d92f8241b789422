"""Supply sag: the DC bus drops with the current drawn through the source resistance."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="supply_sag",
    parameters=(Parameter("resistance", "ohm", 0.0, 0.0, 3.0, 0.2, "resistance of source and wiring"),),
    sentence="the supply sags by {resistance:.2g} V per ampere",
    separated_by="record of the bus voltage; a motion fast enough to reach the voltage limit",
    plants=("ema",),
)
