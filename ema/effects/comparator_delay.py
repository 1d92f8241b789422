"""Delay of comparator and gate driver: a leg switches some time after its current has left the band.

Currents overshoot the hysteresis band by what they move in that time, 0.1 A/µs in the actuator this was written for.
"""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="comparator_delay",
    parameters=(
        Parameter("time", "s", 0.0, 0.0, 5e-06, 1e-06, "from the comparator's decision to the leg's switching"),
    ),
    sentence="the legs of the inverter switch {time:.2g} s later than their comparators decide",
    separated_by="gate signals, or currents sampled without anti-alias filter",
    mistaken_for=(),
    plants=("ema",),
    limits={"time": NOT_NEGATIVE},
    looks=(Look("time"),),
)
