"""Delay of the speed signal (differentiation, filter)."""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, ONE_STEP, Effect, Parameter
from .search import AxisSizes, Look, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if not {"w_m", "v"} & s.outputs:
        return None
    return {"time": Span(0.0, 20.0 * s.period, (0.3 * s.period, 3.0 * s.period), 0.3 * s.period)}


EFFECT = Effect(
    name="speed_delay",
    parameters=(Parameter("time", "s", 0.0, 0.0, 0.004, 0.0005, "delay of the motor speed in the control loop"),),
    sentence="the speed reaches the controller {time:.2g} s late",
    separated_by="a step or fast chirp with the motor angle recorded",
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"time": NOT_NEGATIVE},
    least_sd={"time": ONE_STEP},
    place="loop",
    looks=(Look("time"),),
    on_axis=on_axis,
)
