"""Encoder error: the measured angle wobbles once and twice per turn, the speed has a sensor of its own."""

from __future__ import annotations

from collections.abc import Mapping

from . import per_turn
from .base import Effect
from .search import AxisSizes, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    return per_turn.spans(0.2, 1e-3, 0.01) if s.turns and {"theta_m", "w_m"} <= s.outputs else None


EFFECT = Effect(
    name="encoder_error",
    parameters=per_turn.parameters("rad", "error", 0.1, 0.01),
    sentence="the angle sensor errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn, the speed's own sensor does not",
    separated_by="constant speed over many turns",
    laws={"position_error": per_turn.wave},
    plants=("axis",),
    place="recorder",
    on_axis=on_axis,
)
