"""ADC saturation: currents beyond a limit are clipped in the record."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="adc_saturation",
    parameters=(Parameter("limit", "A", 30.0, 2.0, 30.0, 12.0, "largest current that is recorded"),),
    sentence="the recorded currents clip at {limit:.3g} A",
    separated_by="a motion with lower current",
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema",),
)
