"""Stribeck effect: sliding friction falls from a higher value as lubrication builds up with speed."""

from __future__ import annotations

from numba import njit, vectorize

from .base import NOT_REVERSED, POSITIVE, Effect, Parameter
from .search import Look
from .vector_math import exp_negative


def factor(theta_m, w_m, theta_u, direction, tau_load, excess, speed, shape):
    """F_d × (1 + e f), x = |ω_m| / ω_s: Tustin's exponential at s = 0, a Gaussian at s = 1, Hess and Soom's at s = -1.

    f = exp(-x (1 + s (x - 1))) above s = 0        f = (1 + s) exp(-x) - s / (1 + x²) below
    """
    x = abs(w_m) / speed
    slow = max(-shape, 0.0)
    fast = exp_negative(min(-x * (1.0 + max(shape, 0.0) * (x - 1.0)), 0.0))
    return 1.0 + excess * ((1.0 - slow) * fast + slow / (1.0 + x * x))


_factor = njit(factor)


@vectorize(nopython=True)
def fade(w_m, speed, shape):
    """f of many speeds at once; 1 at rest."""
    return _factor(0.0, w_m, 0.0, 0.0, 0.0, 1.0, speed, shape) - 1.0


EFFECT = Effect(
    name="stribeck",
    parameters=(
        Parameter(
            "excess", "1", 0.0, 0.0, 1.5, 0.3, "sliding friction at zero speed over its value at high speed, less one"
        ),
        Parameter(
            "speed", "rad/s", 10.0, 0.5, 80.0, 10.0, "speed over which the excess fades to 1/e, at shape -1 to one half"
        ),
        Parameter(
            "shape",
            "1",
            0.0,
            -1.0,
            1.2,
            0.5,
            "how it fades: -1 as 1/(1 + x²), 0 exponentially, 1 as a Gaussian",
            laws_at=(-1.0,),
        ),
    ),
    sentence="Stribeck friction: sliding friction {excess} higher at low speed, fading over {speed:.3g} rad/s",
    separated_by="slow motion at several constant speeds",
    laws={"sliding_friction": factor},
    mistaken_for=("k1",),
    plants=("ema", "axis"),
    limits={"excess": NOT_REVERSED, "speed": POSITIVE},
    looks=tuple(
        Look("excess", steps={"shape": 0.1}, at={"speed": speed, "shape": shape})
        for shape in (0.5, -1.0)  # between these less is left of either: no fit goes from one to the other
        for speed in (4.0, 15.0, 40.0)
    ),
)
