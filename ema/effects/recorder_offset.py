"""Offsets of the recorder's own currents: the controller sees the true current, the record does not."""

from __future__ import annotations

from .base import Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="recorder_offset",
    parameters=(
        Parameter("offset_a", "A", 0.0, -1.0, 1.0, 0.05, "offset of the recorded current of phase A"),
        Parameter("offset_b", "A", 0.0, -1.0, 1.0, 0.05, "offset of the recorded current of phase B"),
        Parameter("offset_c", "A", 0.0, -1.0, 1.0, 0.05, "offset of the recorded current of phase C"),
    ),
    sentence="the recorded currents are offset by {offset_a:+.2g}, {offset_b:+.2g}, {offset_c:+.2g} A "
    "(phases A, B, C); those that the controller sees are not",
    separated_by="currents with the inverter off, recorded and as the controller sees them",
    mistaken_for=("k1", "k3", "k4", "k5"),
    plants=("ema",),
    place="recorder",
    looks=(Look("offset_a", "offset_b", "offset_c"),),
)
