"""Hysteresis comparators that turn where a current leaves its band, not at the next step.

Asked once a step, three comparators whose legs share a floating neutral turn late by up to a step each, one after the
other: every twentieth to eighth turn follows another within 1 µs. What pattern the currents then run through hangs on
the step. Found within the step, turn by turn, it is the same with steps of 0.25 to 2 µs.
"""

from __future__ import annotations

from numba import njit

from ema.effects.inverter import diode

from . import jit

MOST_TURNS = 2  # of a step: of three within 2 µs the third is late
MOST_EVENTS = 6  # the same where legs follow late: a comparator turns, its leg goes off, and on
NEVER = 2.0  # shares of a step
STILL = 1e-12  # [A] per step: a current that moves less leaves no band

_jit = njit(fastmath=jit.FAST, error_model="numpy", forceinline=True)


@_jit
def slopes(u_a, u_b, u_c, L_a, L_b, L_c, dt_LL):
    """By how much i_a and i_b change in a step, under voltages less resistive drop and back-EMF. [A]

    The floating neutral v_n keeps the sum of the currents at zero; eliminated from L_j di_j/dt = u_j - v_n.
    """
    u_ab, u_bc, u_ca = u_a - u_b, u_b - u_c, u_c - u_a
    return (u_ab * L_c - u_ca * L_b) * dt_LL, (u_bc * L_a - u_ab * L_c) * dt_LL


@_jit
def share_until_turn(s_j, error_j, change_j, h):
    """Share of a step after which leg j turns: its current, told too low by `error_j`, changes by `change_j` a step."""
    room = max(h + s_j * error_j, 0.0)
    towards = s_j * change_j
    return room / (towards if towards > STILL else STILL)


@_jit
def share_until_event(off_j, dead, dt):
    """Share of a step after which a leg that follows late goes off (for the dead time) or on again."""
    at = off_j - dead if off_j > dead else off_j
    return at / dt if off_j > 0.0 else NEVER


@_jit
def leg(s_j, i_j, off_j, dead, below):
    """What a leg that follows late makes of half the bus voltage: as before, by its diodes, or as it is told."""
    return -s_j if off_j > dead else (diode(i_j, below) if off_j > 0.0 else s_j)


@_jit
def time_left(off_j, until_event, f, dead, dt):
    """Until the leg is on, a share `f` of a step later. [s]"""
    reached = dead if off_j > dead else 0.0
    return reached if until_event <= f else off_j - f * dt


@_jit
def currents_after(i, e, s, told, R, L, emf, half, h, dt, late):
    """Currents and legs after a step in which legs turn where their comparators say so.

    Parameters
    ----------
    i, e, s : tuples of three
        Currents, what each is told to be too low by, and what the comparators say (±1), at the start. [A]
    told : tuple of three
        What a sensor makes of an ampere.
    R, L, emf : tuples of three
        Of the phases. [Ω, H, V]
    half : float
        Half of the bus voltage. [V]
    late : empty, or three times until the legs are on, delay, dead time, and the current below which it is less
        Where legs follow late. [s, A]

    Returns
    -------
    i, s, off : tuples of three
        At the end; `off`: times until the legs are on.
    work, heat : float
        What the legs gave, and what became warmth. [J]
    """
    L_a, L_b, L_c = L
    dt_LL = dt / (L_a * L_b + L_b * L_c + L_c * L_a)
    n_a, n_b, n_c = i
    s_a, s_b, s_c = s
    off_a, off_b, off_c, dead, below, on = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    most = MOST_TURNS
    if len(late):
        off_a, off_b, off_c, delay, dead, below = late
        on, most = delay + dead, MOST_EVENTS
    left = 1.0
    work, heat = 0.0, 0.0
    for event in range(most + 1):
        v_a, v_b, v_c = half * s_a, half * s_b, half * s_c
        u_a, u_b, u_c = NEVER, NEVER, NEVER
        if len(late):
            v_a = half * leg(s_a, n_a, off_a, dead, below)
            v_b = half * leg(s_b, n_b, off_b, dead, below)
            v_c = half * leg(s_c, n_c, off_c, dead, below)
            u_a = share_until_event(off_a, dead, dt)
            u_b = share_until_event(off_b, dead, dt)
            u_c = share_until_event(off_c, dead, dt)
        d_a, d_b = slopes(
            v_a - R[0] * n_a - emf[0], v_b - R[1] * n_b - emf[1], v_c - R[2] * n_c - emf[2], L_a, L_b, L_c, dt_LL
        )
        d_c = -d_a - d_b
        f_a = share_until_turn(s_a, e[0] - told[0] * (n_a - i[0]), told[0] * d_a, h)
        f_b = share_until_turn(s_b, e[1] - told[1] * (n_b - i[1]), told[1] * d_b, h)
        f_c = share_until_turn(s_c, e[2] - told[2] * (n_c - i[2]), told[2] * d_c, h)
        f = min(min(f_a, f_b), min(f_c, left))
        if len(late):
            f = min(f, min(u_a, min(u_b, u_c)))
        f = f if event < most else left
        m_a, m_b, m_c = n_a + 0.5 * f * d_a, n_b + 0.5 * f * d_b, n_c + 0.5 * f * d_c
        work += f * dt * (v_a * m_a + v_b * m_b + v_c * m_c)
        heat += f * dt * (R[0] * n_a * m_a + R[1] * n_b * m_b + R[2] * n_c * m_c)
        n_a += f * d_a
        n_b += f * d_b
        n_c = -n_a - n_b
        left -= f
        turns_a, turns_b, turns_c = left > 0.0 and f_a <= f, left > 0.0 and f_b <= f, left > 0.0 and f_c <= f
        if len(late):
            off_a = on if turns_a else max(time_left(off_a, u_a, f, dead, dt), 0.0)
            off_b = on if turns_b else max(time_left(off_b, u_b, f, dead, dt), 0.0)
            off_c = on if turns_c else max(time_left(off_c, u_c, f, dead, dt), 0.0)
        s_a = -s_a if turns_a else s_a
        s_b = -s_b if turns_b else s_b
        s_c = -s_c if turns_c else s_c
    return (n_a, n_b, n_c), (s_a, s_b, s_c), (off_a, off_b, off_c), work, heat
