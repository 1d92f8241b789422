"""Position-dependent friction: a worn, dirty or tight stretch of the travel."""

from __future__ import annotations

from numba import njit

from .base import NOT_REVERSED, POSITIVE, Effect, Parameter
from .vector_math import exp_negative

FORMS = (0.0, 1.0)  # ends of the flatness, where searches begin: as a Gaussian, alike from end to end


@njit(inline="always")
def fading(u, flatness):
    """u² (1 + f (u⁶ - 1)), the negative logarithm of a Gaussian (f = 0) or of what is alike from end to end (f = 1)."""
    square = u * u
    return square * (1.0 + flatness * (square * square * square - 1.0))


def factor(theta_m, w_m, theta_u, direction, tau_load, height, centre, width, flatness):
    """F × [1 + h exp(-`fading`(u, f))], u = (θ_u - c)/w"""
    return 1.0 + height * exp_negative(-fading((theta_u - centre) / width, flatness))


EFFECT = Effect(
    name="position_friction",
    parameters=(
        Parameter("height", "1", 0.0, -0.9, 5.0, 0.5, "additional friction at the centre over nominal friction"),
        Parameter("centre", "rad", 0.0, -0.4, 0.4, 0.0, "user position of the stretch"),
        Parameter("width", "rad", 0.001, 0.0001, 0.01, 0.001, "half width, to 1/e of the height"),
        Parameter("flatness", "1", 0.0, 0.0, 1.0, 0.0, "form: 0 as a Gaussian, 1 alike from end to end"),
    ),
    sentence="friction changed by {height} around θ_u = {centre:.2g} rad, half width {width:.2g} rad",
    separated_by="slow motion over the whole travel",
    laws={"static_friction": factor, "sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"height": NOT_REVERSED, "width": POSITIVE},
)
