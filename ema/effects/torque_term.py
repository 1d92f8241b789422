"""A torque or friction term found in data without a name: a product of simple factors, each of which may be absent.

This is what the discovery of structure adds to the axis model; it is no effect of the library.
"""

from __future__ import annotations

import math

from numba import njit

from .vector_math import exp_negative, sin

# One row per term. Speed and current enter by a power; order and frequency zero with phase π/2 leave their factor at 1;
# a width of zero leaves a window open.
COLUMNS = (
    *("coefficient", "order", "angle_phase", "frequency", "time_phase", "speed_power", "current_power"),
    *("angle_centre", "angle_width", "time_centre", "time_width", "is_friction"),
)
EVEN = -1.0
NEUTRAL = (0.0, 0.0, 0.5 * math.pi, 0.0, 0.5 * math.pi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@njit(inline="always")
def window(x, centre, width):
    """exp(-((x - c)/w)²); 1 where the width is zero"""
    u = (x - centre) / (width if width > 0.0 else 1.0)
    return exp_negative(-u * u) if width > 0.0 else 1.0


@njit(inline="always")
def power(x, exponent):
    """1, x or x |x| for exponents 0, 1, 2; |x| for `EVEN`"""
    return 1.0 if exponent == 0.0 else (x if exponent == 1.0 else (abs(x) if exponent < 0.0 else x * abs(x)))


@njit(inline="always")
def value(theta, w, i, t, row):
    """c sin(n θ + φ) sin(2π f t + ψ) ω^a i^b window(θ) window(t).   [N m or N]"""
    return (
        row[0]
        * sin(row[1] * theta + row[2])
        * sin(2.0 * math.pi * row[3] * t + row[4])
        * power(w, row[5])
        * power(i, row[6])
        * window(theta, row[7], row[8])
        * window(t, row[9], row[10])
    )
