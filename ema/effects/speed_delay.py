"""Delay of the speed signal (differentiation, filter)."""

from __future__ import annotations

from .base import NOT_NEGATIVE, Effect, Look, Parameter

EFFECT = Effect(
    name="speed_delay",
    parameters=(Parameter("time", "s", 0.0, 0.0, 0.004, 0.0005, "delay of the motor speed in the control loop"),),
    sentence="the speed reaches the controller {time:.2g} s late",
    separated_by="a step or fast chirp with the motor angle recorded",
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"time": NOT_NEGATIVE},
    place="loop",
    looks=(Look("time"),),
)
