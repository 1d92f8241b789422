"""Backlash: the user follows the gear output only at the ends of the gap (play operator)."""

from __future__ import annotations

from numba import njit

MOBILITY = 1.0  # [rad/(s N m)]


@njit(inline="always")
def follow(theta_u, theta_g, b):
    """Position of a user without inertia behind a gap of half-width `b` around the gear output θ_g.   [rad]"""
    return min(max(theta_u, theta_g - b), theta_g + b)


@njit(inline="always")
def creep(load, F_u):
    """Speed at which a load beyond the user's friction takes the user along within the gap. [rad/s]

    How fast does not matter, as long as it crosses the gap within a millisecond and is stable in every step.
    """
    return MOBILITY * (load - min(max(load, -F_u), F_u))


@njit(inline="always")
def deflection(theta_u, theta_g, b):
    """How far the gear output is pressed beyond the gap: zero inside it.   [rad]"""
    d = theta_g - theta_u
    return d - min(max(d, -b), b)
