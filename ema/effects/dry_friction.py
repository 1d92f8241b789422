"""Dry friction by the four-state rule: stay, break away, keep moving, stop."""

from __future__ import annotations

from numba import njit


@njit(inline="always")
def speed_after(w_m, tau_drive, F_s, F_d, dt_J):
    """Speed one step later of an inertia with dry friction.   [rad/s]

    stay:       ω = 0 and |τ| ≤ F_s       → ω = 0
    break away: ω = 0 and |τ| > F_s       → J dω/dt = τ - F_s sign τ
    move:       ω ≠ 0                     → J dω/dt = τ - F_d sign ω
    stop:       ω would change its sign   → ω = 0

    Parameters
    ----------
    w_m : float
        Speed. [rad/s]
    tau_drive : float
        Sum of all other torques. [N m]
    F_s, F_d : float
        Static and sliding friction torque. [N m]
    dt_J : float
        Step over inertia. [s / (kg m²)]
    """
    held = min(max(tau_drive, -F_s), F_s)
    sliding = F_d if w_m > 0.0 else -F_d
    w_next = w_m + (tau_drive - (held if w_m == 0.0 else sliding)) * dt_J
    return 0.0 if w_m * w_next < 0.0 else w_next


@njit(inline="always")
def rubbing_speed_after(w, tau_drive, F, dt_J):
    """Speed one step later of an inertia that rubs with F, at rest and in motion; at 0 nothing stops it.   [rad/s]"""
    return speed_after(w, tau_drive, F, F, dt_J) if F > 0.0 else w + dt_J * tau_drive
