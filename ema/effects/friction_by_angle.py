"""Friction by angle: a bent shaft or a bearing that is not round rubs more at some angles of a turn than at others."""

from __future__ import annotations

from . import per_turn
from .base import SHARE, Effect

MOST = 0.95  # of dry friction, in one part


def factor(
    theta_m, w_m, theta_u, direction, tau_load, once_cosine, once_sine, twice_cosine, twice_sine
):  # fmt: skip
    """F × [1 + c₁ cos θ_m + s₁ sin θ_m + c₂ cos 2θ_m + s₂ sin 2θ_m]"""
    return 1.0 + per_turn.inlined_wave(theta_m, once_cosine, once_sine, twice_cosine, twice_sine)


EFFECT = Effect(
    name="friction_by_angle",
    parameters=per_turn.parameters("1", "share of dry friction", MOST, 0.1),
    sentence="friction changes with the angle: once ({once_cosine}, {once_sine}) "
    "and twice ({twice_cosine}, {twice_sine}) per turn, as of a bent shaft or a bearing that is not round",
    separated_by="slow motion over several turns",
    laws={"static_friction": factor, "sliding_friction": factor},
    limits=dict.fromkeys(per_turn.PARTS, SHARE),
    plants=("axis",),
)
