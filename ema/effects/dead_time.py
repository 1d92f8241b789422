"""Inverter dead time: after each switching both transistors of a leg are off and the current decides the voltage."""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="dead_time",
    parameters=(Parameter("time", "s", 0.0, 0.0, 5e-06, 1e-06, "time both switches of a leg are off"),),
    sentence="inverter dead time of {time:.2g} s",
    separated_by="phase voltages, or currents sampled without anti-alias filter",
    mistaken_for=("k1",),
    plants=("ema",),
    limits={"time": NOT_NEGATIVE},
    looks=(Look("time"),),
)
