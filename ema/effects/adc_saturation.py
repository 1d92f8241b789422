"""ADC saturation: currents beyond a limit are clipped in the record."""

from __future__ import annotations

from .base import POSITIVE, Effect, Parameter

WIDEST = 1000.0  # [A] no plant's converter reaches further (`Sensors.adc_range`): clips nothing before that does

EFFECT = Effect(
    name="adc_saturation",
    parameters=(Parameter("limit", "A", WIDEST, 0.5, WIDEST, 12.0, "largest current that is recorded"),),
    sentence="the recorded currents clip at {limit:.3g} A",
    separated_by="a motion with lower current",
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema",),
    limits={"limit": POSITIVE},
    place="recorder",
)
