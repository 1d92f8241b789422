"""Hysteresis current control: a comparator for each leg of a two-level inverter."""

from __future__ import annotations

from numba import njit


@njit(inline="always")
def comparator(s_j, error_j, h):
    """State ±1 of a leg: up when the current is more than `h` too low, down when too high, else unchanged."""
    held_or_up = 1.0 if error_j > h else s_j
    return -1.0 if error_j < -h else held_or_up


@njit(inline="always")
def leg_voltage(s_j, i_j, u_dc, off_share):
    """Voltage of a leg against the middle of the DC bus.   [V]

    While both switches are off (dead time, for `off_share` of the step) the current chooses the diode.
    """
    diode = -1.0 if i_j > 0.0 else 1.0
    return 0.5 * u_dc * (s_j + off_share * (diode - s_j))
