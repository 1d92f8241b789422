"""Delay of the user position behind the recorder's tap: the record has it in time, the controller does not."""

from __future__ import annotations

from .base import NOT_NEGATIVE, ONE_STEP, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="controller_delay",
    parameters=(
        Parameter("time", "s", 0.0, 0.0, 0.004, 0.0005, "delay of the user position from the record to the controller"),
    ),
    sentence="the user position reaches the controller {time:.2g} s later than the record",
    separated_by="a step or fast chirp with the motor angle recorded",
    mistaken_for=("k1", "k3", "k4", "k5"),
    plants=("ema",),
    limits={"time": NOT_NEGATIVE},
    least_sd={"time": ONE_STEP},
    place="loop",
    looks=(Look("time"),),
)
