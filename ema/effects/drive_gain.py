"""Gain error of the drive's sensor: the recorded current, voltage or force is a share too large."""

from __future__ import annotations

from .base import Effect, Parameter

EFFECT = Effect(
    name="drive_gain",
    parameters=(Parameter("gain", "1", 0.0, -0.3, 0.3, 0.03, "relative gain error of the recorded drive"),),
    sentence="the recorded drive (current, voltage or force) reads {gain:+.2%} of its true value",
    separated_by="a known load (weight on a lever), or a second sensor",
    mistaken_for=("k1",),
    plants=("axis",),
    place="recorder",
)
