"""Anti-alias filter of the recorded currents: another corner frequency, or another number of stages, than stated.

What the controller sees is not filtered; only the record is.
"""

from __future__ import annotations

from .base import ABSENT, NOT_REVERSED, Effect, Parameter
from .search import Look

EFFECT = Effect(
    name="current_filter",
    parameters=(
        Parameter(
            "change",
            "1",
            0.0,
            ABSENT,
            3.0,
            0.3,
            "relative change of the time constants of the anti-alias stages; -1: none",
            laws_at=(ABSENT,),
        ),
    ),
    sentence="the time constants of the anti-alias filter of the recorded currents differ by {change:+z.0%}",
    separated_by="a step of current with the rotor locked",
    mistaken_for=(),
    plants=("ema",),
    limits={"change": NOT_REVERSED},
    least_sd={"change": 3e-3},  # half a microsecond, of the comparators' grid, in 159 µs of both stages together
    place="recorder",
    looks=(Look("change"),),
)
