"""Position-dependent friction: a worn, dirty or tight stretch of the travel."""

from __future__ import annotations

from .base import NOT_REVERSED, POSITIVE, Effect, Parameter
from .vector_math import exp_negative


def factor(theta_m, w_m, theta_u, direction, tau_load, height, centre, width):
    """F × [1 + h exp(-((θ_u - c)/w)²)]"""
    u = (theta_u - centre) / width
    return 1.0 + height * exp_negative(-u * u)


EFFECT = Effect(
    name="position_friction",
    parameters=(
        Parameter("height", "1", 0.0, -0.9, 5.0, 0.5, "additional friction at the centre over nominal friction"),
        Parameter("centre", "rad", 0.0, -0.4, 0.4, 0.0, "user position of the stretch"),
        Parameter("width", "rad", 0.001, 0.0001, 0.01, 0.001, "half width, to 1/e of the height"),
    ),
    sentence="friction changed by {height} around θ_u = {centre:.2g} rad, half width {width:.2g} rad",
    separated_by="slow motion over the whole travel",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"height": NOT_REVERSED, "width": POSITIVE},
)
