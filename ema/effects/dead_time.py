"""Inverter dead time: after each switching both transistors of a leg are off and the current decides the voltage."""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="dead_time",
    parameters=(
        Parameter("time", "s", 0.0, 0.0, 5e-06, 1e-06, "time both switches of a leg are off"),
        Parameter(
            "below", "A", 0.0, 0.0, 2.0, 0.1, "current below which the switches' capacitance holds the leg between"
        ),
    ),
    sentence="inverter dead time of {time:.2g} s",
    besides={"below": ", less below {below:.2g} A"},
    separated_by="phase voltages, or currents sampled without anti-alias filter",
    mistaken_for=("k1",),
    plants=("ema",),
    limits=dict.fromkeys(("time", "below"), NOT_NEGATIVE),
    looks=(Look("time", at={"below": 0.1}),),
)
