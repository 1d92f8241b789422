"""Current-sensor offsets: what controller and recorder read of each phase is a constant too much."""

from __future__ import annotations

from .base import Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="current_offset",
    parameters=(
        Parameter("offset_a", "A", 0.0, -1.0, 1.0, 0.05, "offset of the sensor in phase A"),
        Parameter("offset_b", "A", 0.0, -1.0, 1.0, 0.05, "offset of the sensor in phase B"),
        Parameter("offset_c", "A", 0.0, -1.0, 1.0, 0.05, "offset of the sensor in phase C"),
    ),
    sentence="current sensors are offset by {offset_a:+.2g}, {offset_b:+.2g}, {offset_c:+.2g} A (phases A, B, C)",
    separated_by="currents with the inverter off",
    mistaken_for=("k1", "k3", "k4", "k5"),
    plants=("ema",),
    place="loop",
    looks=(Look("offset_a", "offset_b", "offset_c"),),
)
