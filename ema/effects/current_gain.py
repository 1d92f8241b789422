"""Current-sensor gain errors: what controller and recorder read of each phase is too much or too little."""

from __future__ import annotations

from .base import Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="current_gain",
    parameters=(
        Parameter("gain_a", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the sensor in phase A"),
        Parameter("gain_b", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the sensor in phase B"),
        Parameter("gain_c", "1", 0.0, -0.1, 0.1, 0.01, "relative gain error of the sensor in phase C"),
    ),
    sentence="current sensors read {gain_a:+z.1%}, {gain_b:+z.1%}, {gain_c:+z.1%} (phases A, B, C) of the true current",
    separated_by="all three phase currents at rest under load: their sum must vanish",
    mistaken_for=("k3", "k4", "k5"),
    plants=("ema",),
    place="loop",
    looks=(Look("gain_a", "gain_b", "gain_c", steps=dict.fromkeys(("gain_a", "gain_b", "gain_c"), 0.02)),),
)
