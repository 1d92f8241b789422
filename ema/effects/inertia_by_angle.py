"""Inertia by angle: a crank, a linkage or an eccentric load moves more mass at some angles of a turn than at others."""

from __future__ import annotations

from collections.abc import Mapping

from . import per_turn
from .base import SHARE, Effect
from .search import AxisSizes, Span


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins: of an axis that turns far enough."""
    return per_turn.spans(0.9, 0.01, 0.03) if per_turn.is_shown(s) and s.moves else None


EFFECT = Effect(
    name="inertia_by_angle",
    parameters=per_turn.parameters("1", "share of the inertia", 0.9, 0.1),
    sentence="the inertia changes with the angle: once ({once_cosine:+.2g}, {once_sine:+.2g}) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} of it) per turn, as with a crank or a linkage",
    separated_by="turns run out without a drive, and slow turns, in which it does nothing",
    laws={"inertia_share": per_turn.wave, "inertia_slope": per_turn.slope},
    limits=dict.fromkeys(per_turn.PARTS, SHARE),
    plants=("axis",),
    on_axis=on_axis,
)
