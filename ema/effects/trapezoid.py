"""Trapezoidal back-EMF with a 120° flat top, and the six-step commutation that belongs to it."""

from __future__ import annotations

from numba import njit

from .vector_math import TWO_PI, fraction_of_turn


@njit(inline="always")
def _ramp(theta_e):
    """Triangle wave in phase with the sine, from -3 to 3; the trapezoid is its clipped middle."""
    return 3.0 - 12.0 * abs(fraction_of_turn(theta_e / TWO_PI - 0.25))


@njit(inline="always")
def trap(theta_e):
    """Unit trapezoid in phase with sin θ_e, flat from 30° to 150°."""
    return min(max(_ramp(theta_e), -1.0), 1.0)


@njit(inline="always")
def six_step(theta_e):
    """Reference current of one phase per unit: the sign of the trapezoid's flat top, else 0."""
    r = _ramp(theta_e)
    return 1.0 if r >= 1.0 else (-1.0 if r <= -1.0 else 0.0)
