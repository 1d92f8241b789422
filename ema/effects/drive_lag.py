"""Lag of the drive: a current loop of finite bandwidth, so that the torque follows what is recorded with a delay.

Where the record holds the current (or torque, or voltage) that was asked for, what acts is that through a filter of the
first order: τ di/dt = i_ref - i. In a speed loop it is the current that the loop asks for.
"""

from __future__ import annotations

from collections.abc import Mapping

from .base import NOT_NEGATIVE, Effect, Parameter
from .search import AxisSizes, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if not s.moves:
        return None
    return {"time": Span(0.0, 40.0 * s.period, (0.5 * s.period, 5.0 * s.period), 0.3 * s.period)}


EFFECT = Effect(
    name="drive_lag",
    parameters=(
        Parameter("time", "s", 0.0, 0.0, 0.05, 0.001, "time constant with which torque follows the recorded drive"),
    ),
    sentence="the torque follows the recorded drive with a time constant of {time:.2g} s (bandwidth of its loop)",
    separated_by="a step of the drive with the rotor locked and the current measured",
    plants=("axis",),
    limits={"time": NOT_NEGATIVE},
    place="loop",
    on_axis=on_axis,
)
