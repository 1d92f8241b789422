"""Elementary functions that stay vector instructions when a JIT runs many lanes: polynomials, no calls, no branches."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TWO_PI = 2.0 * math.pi


@njit(inline="always")
def fraction_of_turn(turns):
    """Turns folded to [-0.5, 0.5)."""
    return turns - np.floor(turns + 0.5)


@njit(inline="always")
def sin(x):
    """Sine to 3e-11 absolute for |x| up to some thousand turns (odd polynomial, Chebyshev fit on a quarter turn)."""
    u = 0.25 - abs(fraction_of_turn(x / TWO_PI - 0.25))  # sine is even about a quarter of a turn
    s = u * u
    return u * (
        6.283185307072583
        + s
        * (
            -41.341702116996295
            + s * (81.60522620630913 + s * (-76.70428132153378 + s * (42.00980572538451 - s * 14.39413534623377)))
        )
    )


@njit(inline="always")
def cos(x):
    """Cosine, see `sin`."""
    return sin(x + 0.5 * math.pi)


@njit(inline="always")
def exp_negative(x):
    """exp(x) for x ≤ 0, to 2e-4 relative down to x = -5: [(1 + x/128)/(1 - x/128)]^64, six squarings."""
    y = (x if x > -60.0 else -60.0) / 128.0
    q = (1.0 + y) / (1.0 - y)
    q2 = q * q
    q4 = q2 * q2
    q8 = q4 * q4
    q16 = q8 * q8
    q32 = q16 * q16
    return q32 * q32
