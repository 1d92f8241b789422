"""Gain error of the drive's sensor: the recorded current, voltage or force is a share too large."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    return None if s.driven_by == "speed-loop" else {"gain": Span(-0.5, 1.0, (0.02,), 0.02)}


EFFECT = Effect(
    name="drive_gain",
    parameters=(Parameter("gain", "1", 0.0, -0.3, 0.3, 0.03, "relative gain error of the recorded drive"),),
    sentence="the recorded drive (current, voltage or force) reads {gain:+z.2%} of its true value",
    separated_by="a known load (weight on a lever), or a second sensor",
    mistaken_for=("k1",),
    plants=("axis",),
    place="recorder",
    on_axis=on_axis,
)
