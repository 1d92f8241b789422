"""Offset of the drive's sensor: the recorded current, voltage or force is a constant too large."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="drive_offset",
    parameters=(Parameter("offset", "A, V or N", 0.0, -10.0, 10.0, 0.02, "constant added to the recorded drive"),),
    sentence="the recorded drive (current, voltage or force) is offset by {offset:+.3g}",
    separated_by="a record with the drive switched off",
    mistaken_for=("k1",),
    plants=("axis",),
    place="recorder",
)
