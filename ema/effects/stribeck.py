"""Stribeck effect: sliding friction falls from a higher value as lubrication builds up with speed."""

from __future__ import annotations

from .base import NOT_REVERSED, POSITIVE, Effect, Parameter
from .search import Look
from .vector_math import exp_negative


def factor(theta_m, w_m, theta_u, direction, tau_load, excess, speed, shape):
    """F_d × [1 + e exp(-x (1 + s (x - 1)))], x = |ω_m| / ω_s: Tustin's exponential (s = 0) to a Gaussian (s = 1)."""
    x = abs(w_m) / speed
    return 1.0 + excess * exp_negative(min(-x * (1.0 + shape * (x - 1.0)), 0.0))


EFFECT = Effect(
    name="stribeck",
    parameters=(
        Parameter(
            "excess", "1", 0.0, 0.0, 1.5, 0.3, "sliding friction at zero speed over its value at high speed, less one"
        ),
        Parameter("speed", "rad/s", 10.0, 0.5, 80.0, 10.0, "speed over which the excess fades by 1/e"),
        Parameter("shape", "1", 0.0, 0.0, 1.2, 0.5, "how it fades: 0 exponentially, 1 as a Gaussian"),
    ),
    sentence="Stribeck friction: sliding friction {excess} higher at low speed, fading over {speed:.3g} rad/s",
    separated_by="slow motion at several constant speeds",
    laws={"sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"excess": NOT_REVERSED, "speed": POSITIVE},
    looks=tuple(Look("excess", at={"speed": speed, "shape": 0.5}) for speed in (4.0, 15.0, 40.0)),
)
