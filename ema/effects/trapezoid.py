"""Trapezoidal back-EMF with a 120° flat top, and the six-step commutation that belongs to it."""

from __future__ import annotations

import numpy as np
from numba import njit

from .vector_math import TWO_PI, fraction_of_turn


@njit(inline="always")
def trap(theta_e):
    """Unit trapezoid in phase with sin θ_e, flat from 30° to 150°: the clipped middle of a triangle wave."""
    ramp = 3.0 - 12.0 * abs(fraction_of_turn(theta_e / TWO_PI - 0.25))
    return min(max(ramp, -1.0), 1.0)


@njit(inline="always")
def sector(theta_e):
    """Number of the 60° sector, counted from 30° electrical; one number for all three phases, so that at a corner
    rounding cannot leave two of them idle at once.
    """
    return np.floor(6.0 * theta_e / TWO_PI - 0.5)


@njit(inline="always")
def six_step(sector_j):
    """Reference current per unit of a phase: 1 in its sectors 0 and 1, -1 in 3 and 4, else 0 (phase B: sector - 2)."""
    m = sector_j - 6.0 * np.floor(sector_j / 6.0)
    away = abs(3.0 - abs(m - 3.5))  # from the middle of sectors 0 and 1, which is 0.5
    return min(max(1.5 - away, -1.0), 1.0)
