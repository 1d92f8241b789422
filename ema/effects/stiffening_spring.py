"""A spring or a cable that is stiffer (or softer) at the ends of the travel than in its middle."""

from __future__ import annotations

import numpy as np
from numba import njit

from .base import POSITIVE, Effect, Parameter


@njit(inline="always")
def bends(x, growth):
    """Torque whose slope grows from 0 in the middle, x = 0, to 1 at both ends, -1 and 1: for little growth a cube.

    Beyond the ends it goes on straight.
    """
    inside = np.minimum(np.maximum(x, -1.0), 1.0)
    return (np.sinh(growth * inside) / growth - inside) / (np.cosh(growth) - 1.0) + x - inside


@njit(inline="always")
def tilts(x, growth):
    """Torque whose slope is -1 at the lower end, 0 in the middle, 1 at the upper end: for little growth a square.

    Beyond the ends it goes on straight.
    """
    inside = np.minimum(np.maximum(x, -1.0), 1.0)
    return (np.cosh(growth * inside) - 1.0) / (growth * np.sinh(growth)) + np.abs(x - inside)


def torque(theta_m, w_m, theta_u, i_q, middle, lower, upper, bias, centre, half, over):
    """τ = b + ∫ k dθ from the centre; k = k_0 + k_1 cosh((θ - θ_c)/w) + k_2 sinh((θ - θ_c)/w)   [N m]"""
    if middle == 0.0 and lower == 0.0 and upper == 0.0:  # most axes have none, and hyperbolic functions take time
        return bias + 0.0 * theta_m
    x, growth = (theta_m - centre) / half, half / over
    bent = (0.5 * (lower + upper) - middle) * bends(x, growth)
    return bias + half * (middle * x + bent + 0.5 * (upper - lower) * tilts(x, growth))


EFFECT = Effect(
    name="stiffening_spring",
    parameters=(
        Parameter("middle", "N m/rad", 0.0, -5000.0, 20000.0, 1.0, "stiffness in the middle of the travel"),
        Parameter("lower", "N m/rad", 0.0, -5000.0, 50000.0, 1.0, "stiffness at its lower end"),
        Parameter("upper", "N m/rad", 0.0, -5000.0, 50000.0, 1.0, "stiffness at its upper end"),
        Parameter("bias", "N m", 0.0, -100.0, 100.0, 0.0, "torque in the middle"),
        Parameter("centre", "rad", 0.0, -1e4, 1e4, 0.0, "where the middle is"),
        Parameter("half", "rad", 1.0, 1e-6, 1e4, 1.0, "from the middle to an end"),
        Parameter("over", "rad", 1.0, 1e-6, 1e5, 1.0, "way over which what stiffens grows e times; long: parabolas"),
    ),
    sentence="a spring (or a cable) that is not equally stiff everywhere: {lower:.3g} N m/rad at the lower end of the "
    "travel, {middle:.3g} N m/rad in the middle, {upper:.3g} N m/rad at the upper end; its {bias:.3g} N m in the "
    "middle may be a constant load or friction by direction as well",
    separated_by="slow motion over the whole travel, and the same with the shaft upright",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
    limits={"half": POSITIVE, "over": POSITIVE},
)
