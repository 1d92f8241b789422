"""Hysteresis current control: a comparator for each leg of a two-level inverter."""

from __future__ import annotations

from numba import njit

TINY = 1e-12  # [A] over which nothing is divided


@njit(inline="always")
def comparator(s_j, error_j, h):
    """State ±1 of a leg: up when the current is more than `h` too low, down when too high, else unchanged."""
    held_or_up = 1.0 if error_j > h else s_j
    return -1.0 if error_j < -h else held_or_up


@njit(inline="always")
def diode(i_j, below):
    """State ±1 that the current gives a leg while both its switches are off; between, where it is `below` that.

    What little current there is has to load the switches' capacitances first. [A]
    """
    full = -1.0 if i_j > 0.0 else 1.0
    return full if abs(i_j) >= below else -i_j / max(below, TINY)


@njit(inline="always")
def leg_voltage(s_j, i_j, u_dc, late_share, off_share, below):
    """Voltage of a leg against the middle of the DC bus.   [V]

    For `late_share` of the step the leg is still as it was before its comparator turned to s_j. While both switches are
    off (dead time, for `off_share` of the step) the current chooses the diode.
    """
    return 0.5 * u_dc * (s_j - 2.0 * late_share * s_j + off_share * (diode(i_j, below) - s_j))


@njit(inline="always")
def share_of_step(time, dt):
    """What a time from the beginning of a step takes of it."""
    return min(max(time / dt, 0.0), 1.0)
