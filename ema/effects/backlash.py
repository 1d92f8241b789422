"""Backlash: the user follows the gear output only at the ends of the gap (play operator)."""

from __future__ import annotations

from numba import njit


@njit(inline="always")
def follow(theta_u, theta_g, b):
    """Position of a user without inertia behind a gap of half-width `b` around the gear output θ_g.   [rad]"""
    return min(max(theta_u, theta_g - b), theta_g + b)


@njit(inline="always")
def deflection(theta_u, theta_g, b):
    """How far the gear output is pressed beyond the gap: zero inside it.   [rad]"""
    d = theta_g - theta_u
    return d - min(max(d, -b), b)
