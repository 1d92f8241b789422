"""Delay of the recorder's own user position: the controller has it in time, the record does not."""

from __future__ import annotations

from .base import NOT_NEGATIVE, ONE_STEP, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="recorder_delay",
    parameters=(Parameter("time", "s", 0.0, 0.0, 0.004, 0.0005, "delay of the user position in the record alone"),),
    sentence="the user position is recorded {time:.2g} s late; the controller has it in time",
    separated_by="a step, with the motor angle recorded",
    mistaken_for=("k2",),
    plants=("ema",),
    limits={"time": NOT_NEGATIVE},
    least_sd={"time": ONE_STEP},
    place="recorder",
    looks=(Look("time"),),
)
