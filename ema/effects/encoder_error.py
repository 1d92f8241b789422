"""Encoder error: the measured angle wobbles once and twice per turn, the speed has a sensor of its own."""

from __future__ import annotations

from .base import Effect
from .resolver_error import EFFECT as RESOLVER
from .resolver_error import error

EFFECT = Effect(
    name="encoder_error",
    parameters=RESOLVER.parameters,
    sentence="the angle sensor errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn, the speed's own sensor does not",
    separated_by="constant speed over many turns",
    laws={"position_error": error},
    plants=("axis",),
    place="recorder",
)
