"""Encoder error: the measured angle wobbles once and twice per turn, the speed has a sensor of its own."""

from __future__ import annotations

from collections.abc import Mapping

from .base import Effect
from .resolver_error import EFFECT as RESOLVER
from .resolver_error import error
from .search import AxisSizes, Span

PARTS = ("once_cosine", "once_sine", "twice_cosine", "twice_sine")


def on_axis(s: AxisSizes) -> Mapping[str, Span] | None:
    """Where a search begins, by what the records hold."""
    if not s.turns or not {"theta_m", "w_m"} <= s.outputs:
        return None
    return dict.fromkeys(PARTS, Span(-0.2, 0.2, (1e-3,), 0.01))


EFFECT = Effect(
    name="encoder_error",
    parameters=RESOLVER.parameters,
    sentence="the angle sensor errs once ({once_cosine:+.2g}, {once_sine:+.2g} rad) "
    "and twice ({twice_cosine:+.2g}, {twice_sine:+.2g} rad) per turn, the speed's own sensor does not",
    separated_by="constant speed over many turns",
    laws={"position_error": error},
    plants=("axis",),
    place="recorder",
    on_axis=on_axis,
)
