"""Resolver error: the measured rotor angle wobbles once and twice per turn."""

from __future__ import annotations

from collections.abc import Mapping

from . import per_turn
from .base import Effect, Parameter
from .search import AxisSizes, Look, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    return per_turn.spans(0.2, 1e-3, 0.01) if s.turns else None


def angle_error(theta_m, once_cosine, once_sine, twice_cosine, twice_sine, in_speed):
    """`per_turn.wave`"""
    return per_turn.inlined_wave(theta_m, once_cosine, once_sine, twice_cosine, twice_sine)


EFFECT = Effect(
    name="resolver_error",
    parameters=(
        *per_turn.parameters("rad", "error", 0.1, 0.01),
        Parameter(
            "in_speed",
            "1",
            1.0,
            0.0,
            1.0,
            0.5,
            "share of it in the speed: 0 of a tachometer beside it",
            laws_at=(0.0, 1.0),
        ),
    ),
    sentence="the resolver errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn",
    separated_by="constant speed over many turns",
    laws={"angle_error": angle_error},
    mistaken_for=("k6",),
    plants=("ema", "axis"),
    place="loop",
    looks=tuple(Look(*per_turn.PARTS, steps={"in_speed": 0.1}, at={"in_speed": share}) for share in (1.0, 0.0)),
    on_axis=on_axis,
)
