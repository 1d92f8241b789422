"""Gain errors of the recorder's own currents: the controller sees the true current, the record does not."""

from __future__ import annotations

from .base import Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="recorder_gain",
    parameters=(
        Parameter("gain_a", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the recorded current of phase A"),
        Parameter("gain_b", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the recorded current of phase B"),
        Parameter("gain_c", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the recorded current of phase C"),
    ),
    sentence="the recorder reads {gain_a:+z.1%}, {gain_b:+z.1%}, {gain_c:+z.1%} (phases A, B, C) of the true current; "
    "the controller does not",
    separated_by="all three phase currents at rest under load, recorded and as the controller sees them",
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema",),
    place="recorder",
    looks=(Look("gain_a", "gain_b", "gain_c", steps=dict.fromkeys(("gain_a", "gain_b", "gain_c"), 0.02)),),
)
