"""Offset of the drive's sensor: the recorded current, voltage or force is a constant too large."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect, Parameter
from .search import AxisSizes, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if s.driven_by == "speed-loop":
        return None
    return {"offset": Span(-3.0 * s.drive, 3.0 * s.drive, (0.02 * s.drive,), 0.02 * s.drive)}


EFFECT = Effect(
    name="drive_offset",
    parameters=(Parameter("offset", "A, V or N", 0.0, -10.0, 10.0, 0.02, "constant added to the recorded drive"),),
    sentence="the recorded drive (current, voltage or force) is offset by {offset:+.3g} A, V or N",
    separated_by="a record with the drive switched off",
    mistaken_for=("k1",),
    plants=("axis",),
    place="recorder",
    on_axis=on_axis,
)
