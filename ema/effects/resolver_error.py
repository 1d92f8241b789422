"""Resolver error: the measured rotor angle wobbles once and twice per turn."""

from __future__ import annotations

from collections.abc import Mapping

from . import per_turn
from .base import Effect
from .search import AxisSizes, Look, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    return per_turn.spans(0.2, 1e-3, 0.01) if s.turns else None


EFFECT = Effect(
    name="resolver_error",
    parameters=per_turn.parameters("rad", "error", 0.1, 0.01),
    sentence="the resolver errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn",
    separated_by="constant speed over many turns",
    laws={"angle_error": per_turn.wave},
    mistaken_for=("k6",),
    plants=("ema", "axis"),
    place="loop",
    looks=(Look(*per_turn.PARTS),),
    on_axis=on_axis,
)
