"""The axis model's equations: one inertia or mass from sample to sample of a recorded drive.

    J dω_m/dt = τ_m - τ_load - C ω_m - τ_friction(ω_m, τ) - τ_effects     τ_m = k_t i  (or the recorded force)
    L di/dt   = u - R i - k_e ω_m                                    where the voltage drives
    i         = sat(K_w (ω_ref - ω_m,measured), ±I_max)              where the speed loop is simulated

A gear that gives (`gear_compliance`) takes the inertia J_l at the user out of J and hangs it to a spring:

    (J - J_l) dω_m/dt = … - T      J_l dω_l/dt = T      T = (θ_m - θ_l)/c + d (ω_m - ω_l)

Where the inertia changes with the angle, J [1 + Δ(θ_m)], its momentum does: J [1 + Δ] dω_m/dt = … - ½ J dΔ/dθ ω_m².
Where the angle is measured behind the gear (`drive_compliance`), what hangs to the spring is the motor,
and the drive acts there. A known load τ_load was recorded, and acts on the side of the user.

Dry friction stays, breaks away, keeps moving and stops, or has a memory (`ema.effects.friction_memory`).
For a linear axis read position, speed, mass and force; the equations are the same.
"""

from __future__ import annotations

import math

from numba import njit

from ema.effects import (
    cogging,
    friction_memory,
    gear_play,
    inverter_drop,
    output_load_friction,
    registry,
    supply_sag,
    torque_term,
)
from ema.effects.dry_friction import rubbing_speed_after, speed_after

from . import jit  # noqa: F401  (sets the cache folder before anything is compiled)
from .axis_layout import row
from .hooks import combined

CURRENT, VOLTAGE, FORCE, SPEED_LOOP = range(4)
# What a recorded drive does from one sample to the next; there a speed loop acts too on a command that is held (FAST),
# or runs straight (ANALOGUE).
STRAIGHT, HELD, HELD_BEFORE, FAST, ANALOGUE = range(5)
LEAST = 0.02  # of the inertia that is left where it is measured
CREEP = 1e-9  # [rad/s] at least, where the axis is known to slide
OUTPUTS = ("theta_m", "w_m", "i_q", "u_q")

_inline = njit(forceinline=True, error_model="numpy", fastmath=True)  # by the compiler: many times faster than by numba
_cogging = _inline(cogging.torque)
_applied, _commanded = supply_sag.applied, supply_sag.commanded
shaft_torque = combined("shaft_torque", "axis", row)
drifting_torque = combined("drifting_torque", "axis", row)
drifting_friction = combined("drifting_friction", "axis", row)
user_torque = combined("user_torque", "axis", row)
static_friction = combined("static_friction", "axis", row)
sliding_friction = combined("sliding_friction", "axis", row)
emf_factor = combined("emf_factor", "axis", row)
resistance_factor = combined("resistance_factor", "axis", row)
inductance_factor = combined("inductance_factor", "axis", row)
angle_error = combined("angle_error", "axis", row)
position_error = combined("position_error", "axis", row)
inertia_share = combined("inertia_share", "axis", row)
inertia_slope = combined("inertia_slope", "axis", row)

J, C, F_S, F_D, K_T, K_E, R, L = (row(name) for name in ("J", "C", "F_s", "F_d", "k_t", "k_e", "R", "L"))
K_W, I_MAX, DT, LOAD = row("K_w"), row("I_max"), row("dT"), row("load")
INERTIA, GAIN, OFFSET = row("inertia.change"), row("drive_gain.gain"), row("drive_offset.offset")
DROP, BELOW, ROUNDNESS = (row(f"inverter_drop.{name}") for name in ("voltage", "below", "roundness"))
SKEW, LAG = row("clock_skew.rate"), row("drive_lag.time")
POSITION_DELAY, SPEED_DELAY = row("position_delay.time"), row("speed_delay.time")
COGGING = row("cogging.amplitude")
_beyond = ("compliance", "inertia", "damping", "drag", "friction")  # of what is beyond the gear, seen from the sensor
AT_USER, AT_MOTOR = row("gear_compliance.compliance"), row("drive_compliance.compliance")
assert [row(f"gear_compliance.{x}") - AT_USER for x in _beyond] == [0, 1, 2, 3, 4]
assert [row(f"drive_compliance.{x}") - AT_MOTOR for x in _beyond] == [0, 1, 2, 3, 4]
PLAY = row("gear_play.gap")
_play = ("gap", "inertia", "friction", "damping", "compliance", "driven")
assert [row(f"gear_play.{x}") - PLAY for x in _play] == [0, 1, 2, 3, 4, 5]
LOAD_SHARE, OF_INERTIA = row("output_load_friction.share"), row("output_load_friction.of_inertia")
LOAD_SQUARE = row("quadratic_output_load_friction.per_torque")
DEFLECTION, BRISTLE_DAMPING = row("friction_memory.deflection"), row("friction_memory.damping")
SAG, V_DC = row("supply_sag.resistance"), row("V_dc")
UNEVEN = tuple(row(f"inertia_by_angle.{p.name}") for p in registry()["inertia_by_angle"].parameters)


@_inline
def torques(z, lines, terms, theta, w, i, t):
    """Torques that oppose positive motion besides dry friction.   [N m or N]"""
    tau = z[LOAD] + z[C] * w + shaft_torque(z, 0, 1, theta, w, theta, i) + user_torque(z, 0, 1, theta)
    tau += drifting_torque(z, 0, 1, w, t, z[DT])
    for k in range(lines.shape[0]):
        tau += _cogging(theta, w, theta, i, lines[k, 0], lines[k, 1], lines[k, 2])
    for k in range(terms.shape[0]):
        if terms[k, 11] == 0.0:
            tau += torque_term.value(theta, w, i, t, terms[k])
    return tau


@_inline
def is_uneven(z):
    """Whether the inertia changes with the angle."""
    found = False
    for k in UNEVEN:
        found = found or z[k] != 0.0
    return found


@_inline
def friction(z, lines, terms, theta, w, tau, tau_m, i, t, moves):
    """Static and sliding friction, of an axis that `moves` or is held.   [N m or N]"""
    direction = 1.0 if (w if w != 0.0 else tau) > 0.0 else -1.0
    drift = drifting_friction(z, 0, 1, t, z[DT])
    F_s = z[F_S] * drift * static_friction(z, 0, 1, theta, w, theta, direction, tau_m)
    F_d = z[F_D] * drift * sliding_friction(z, 0, 1, theta, w, theta, direction, tau_m)
    for k in range(terms.shape[0]):
        if terms[k, 11] != 0.0:
            more = torque_term.value(theta, w, i, t, terms[k])
            F_s += more
            F_d += more
    if z[LOAD_SHARE] > 0.0 or z[LOAD_SQUARE] > 0.0:
        load = torques(z, lines, terms, theta, 0.0, i, t)
        square = z[LOAD_SQUARE] * load * load
        passed = output_load_friction.passed_on(
            load, tau - direction * (F_d + square), direction, z[LOAD_SHARE], z[OF_INERTIA] if moves else 0.0
        )
        F_s += z[LOAD_SHARE] * abs(load) + square
        F_d += z[LOAD_SHARE] * passed + square
    return max(F_s, F_d, 0.0), max(F_d, 0.0)  # what keeps sliding at creep holds at rest


@_inline
def delayed(t, x, k, delay, slope, skew):
    """Value of x a `delay` before t[k] by linear interpolation; before the first sample along `slope`.

    A second is 1 / `skew` seconds of the record's clock.
    """
    return earlier(t, x, k, t[k] - delay / skew, slope, skew)


@_inline
def earlier(t, x, k, at, slope, skew):
    """Value of x `at` a time not after t[k], as `delayed`."""
    if at <= t[0]:
        return x[0] + slope * ((at - t[0]) * skew)
    j = k
    while t[j] > at:
        j -= 1
    if j >= k:
        return x[k]
    return x[j] + (x[j + 1] - x[j]) * (at - t[j]) / (t[j + 1] - t[j])


@_inline
def delayed_between(t, x, k, now, x_now, delay, slope, skew):
    """The same a `delay` before a time after t[k], at which the value is `x_now`."""
    at = now - delay / skew
    if at <= t[k]:
        return earlier(t, x, k, at, slope, skew)
    return x[k] + (x_now - x[k]) * (at - t[k]) / (now - t[k])


@_inline
def delayed_position(t, theta, w, k, delay, slope, skew):
    """Position then, by the cubic with the speeds; before the first sample under its acceleration `slope`."""
    at = t[k] - delay / skew
    if at <= t[0]:
        s = (at - t[0]) * skew
        return theta[0] + (w[0] + 0.5 * slope * s) * s
    j = k
    while t[j] > at:
        j -= 1
    if j >= k:
        return theta[k]
    way, h = theta[j + 1] - theta[j], (t[j + 1] - t[j]) * skew
    x = (at - t[j]) * skew / h
    return theta[j] + x * way + x * (1.0 - x) * ((1.0 - x) * (h * w[j] - way) - x * (h * w[j + 1] - way))


@_inline
def current_after(i, e, R, L, h):
    """Current a time `h` later under a constant voltage, exactly.    L di/dt = e - R i   [A]"""
    x = h * R / L
    return e / R + (i - e / R) * math.exp(-x) if x > 1e-6 else i + h / L * e


@_inline
def lost(z, i):
    """Voltage the inverter loses.   [V]"""
    return inverter_drop.drop(i, z[DROP], z[BELOW], z[ROUNDNESS])


@_inline
def gear(z, inertia, h):
    """Stiffness, damping, inertia, drag and friction beyond a gear that gives, whether the drive acts there, and play.

    Zeros where it is stiff at steps of `h`. J_a is what is measured, J_b what is beyond:

    d = 2 ζ √(J_a J_b / (J_a + J_b) / c)
    """
    gap, is_driven = z[PLAY], z[AT_MOTOR] > 0.0
    if gap > 0.0:
        is_driven = z[PLAY + 5] > 0.0
        J_b, rubbing, zeta, c, drag = z[PLAY + 1], z[PLAY + 2], z[PLAY + 3], z[PLAY + 4], 0.0
    else:
        first = AT_MOTOR if is_driven else AT_USER
        c, J_b, zeta, drag, rubbing = z[first], z[first + 1], z[first + 2], z[first + 3], z[first + 4]
    J_a = inertia - J_b
    is_rigid = c <= 0.0 or h * h * inertia > c * J_a * J_b
    if J_a < LEAST * inertia or (is_rigid and gap == 0.0):
        return 0.0, 0.0, 0.0, 0.0, 0.0, False, 0.0
    if gap > 0.0:
        c = max(c, gear_play.CONTACT * h * h * inertia / (J_a * J_b))
    return 1.0 / c, 2.0 * zeta * math.sqrt(J_a * J_b / inertia / c), J_b, drag, rubbing, is_driven, gap


@njit(inline="always")
def share_then(between, x):
    """Which share of the way to the next sample's value a recorded drive has gone, a share `x` of the time later."""
    return x if between == STRAIGHT else 0.0 if between == HELD else 1.0


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def beyond_after(z, mode, between, t, theta, drive, load, h_max, theta_b, w_b):
    """Position and speed beyond a gear, given at t[0], at the end of a recorded motion under a recorded drive."""
    inertia = z[J] * (1.0 + z[INERTIA])
    gain, R_now = 1.0 / (1.0 + z[GAIN]), max(z[R] * resistance_factor(z, 0, 1, z[DT]), 1e-9)
    for k in range(t.shape[0] - 1):
        span = (t[k + 1] - t[k]) * (1.0 + z[SKEW])
        n_steps = max(1, math.ceil(span / h_max - 1e-9))
        h = span / n_steps
        stiffness, damping, J_b, drag, rubbing, is_driven, gap = gear(z, inertia, h)
        w = (theta[k + 1] - theta[k]) / span
        if stiffness == 0.0:
            theta_b, w_b = theta[k + 1], w
            continue
        for s in range(n_steps):
            x = (s + 0.5) / n_steps
            T = gear_play.through(theta[k] + x * span * w - theta_b - 0.5 * h * w_b, w - w_b, stiffness, damping, gap)
            if is_driven:
                u = (drive[k] + share_then(between, x) * (drive[k + 1] - drive[k]) - z[OFFSET]) * gain
                if mode == VOLTAGE:
                    u = (u - z[K_E] * emf_factor(z, 0, 1, 0.0, z[DT]) * w_b) / R_now
                T += u if mode == FORCE else z[K_T] * emf_factor(z, 0, 1, u, z[DT]) * u
            else:
                T -= load[k] + x * (load[k + 1] - load[k])
            theta_b += 0.5 * h * w_b
            w_b = rubbing_speed_after(w_b, T - drag * w_b, rubbing, h / J_b)
            theta_b += 0.5 * h * w_b
    return theta_b, w_b


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def bristle_after(z, theta, play, s, seen, way):
    """Share of friction that is built up, given at `seen`, at the end of a recorded motion with noise within ±`play`.

    Also the angle that is `seen` there, and which `way` it went last: 1, -1, or 0 before the first. What noise can
    make is no turn; what is more is one, and counts whole.
    """
    for k in range(theta.shape[0]):
        moved = theta[k] - seen
        if moved * way > 0.0 or abs(moved) > 2.0 * play:
            s = friction_memory.built_up(s, moved, z[DEFLECTION])
            seen, way = theta[k], 1.0 if moved > 0.0 else -1.0
    return s, seen, way


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def simulate_window(z, lines, terms, mode, between, t, drive, load, start, slide, h_max, out):
    """Simulate one window.

    Parameters
    ----------
    z : array, shape (N_ROWS,)
        Parameters and effects.
    lines : array, shape (n_lines, 3)
        Cogging lines: amplitude, order, phase.
    terms : array, shape (n_terms, len(torque_term.COLUMNS))
    mode : int
        CURRENT, VOLTAGE, FORCE or SPEED_LOOP: what `drive` is (current, voltage, force, commanded speed).
    between : int
        STRAIGHT, HELD or HELD_BEFORE: from sample to sample the drive runs straight, holds the value of the first, or
        that of the second. A commanded speed is held and its loop acts once a sample, or (FAST) between samples too,
        or (ANALOGUE) the command runs straight as well.
    t, drive, load : arrays, shape (n_times,)
        Sample times, the recorded drive and the torque of a known load against positive motion.
    start : array, shape (5,)
        Position, speed, by how much what is beyond a gear that gives is behind in both, and the share of friction
        that is built up.
    slide : float
        ±1 where the axis is known to slide that way throughout: friction never turns round nor holds. 0: the full rule.
    h_max : float
        Longest step. [s]
    out : array, shape (4, n_times)
        Filled with `OUTPUTS` as the sensors show them.
    """
    n = t.shape[0]
    theta, w = start[0], start[1]
    theta_b, w_b = theta - start[2], w - start[3]
    bristle, deflection = start[4], z[DEFLECTION]
    inertia = z[J] * (1.0 + z[INERTIA])
    stiffness, damping, J_b, drag, rubbing, is_driven, gap = gear(z, inertia, h_max)
    J_a = J_now = inertia - J_b
    uneven = is_uneven(z)
    gain = 1.0 / (1.0 + z[GAIN])
    R_now = z[R] * resistance_factor(z, 0, 1, z[DT])
    skew = 1.0 + z[SKEW]
    i, i_end, asked, slope, dw, dw_b = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if mode == VOLTAGE:
        u = (drive[0] - z[OFFSET]) * gain
        i = (u - z[K_E] * emf_factor(z, 0, 1, 0.0, z[DT]) * (w_b if is_driven else w)) / max(R_now, 1e-9)
    for k in range(n):
        out[0, k], out[1, k], out[3, k] = theta, w, w_b if is_driven else w
        if mode == CURRENT:
            i = (drive[k] - z[OFFSET]) * gain
        elif mode == SPEED_LOOP:
            w_meas = delayed(t, out[1], k, z[SPEED_DELAY], slope, skew)
            asked = z[K_W] * (drive[k] - w_meas)
            if k == 0 or z[LAG] == 0.0:
                i = i_end = min(max(asked, -z[I_MAX]), z[I_MAX])
        out[2, k] = i
        if k == n - 1:
            break
        span = (t[k + 1] - t[k]) * skew
        n_steps = max(1, math.ceil(span / h_max - 1e-9))
        h = span / n_steps
        kept = math.exp(-h / z[LAG]) if mode == SPEED_LOOP and z[LAG] > 0.0 else 0.0  # of the lag's error, by a step
        for s in range(n_steps):
            x = (s + 0.5) / n_steps
            t_mid = t[k] + x * (t[k + 1] - t[k])
            z[LOAD] = load[k] + x * (load[k + 1] - load[k])
            if mode == SPEED_LOOP:
                if between in (FAST, ANALOGUE):
                    w_meas = delayed_between(t, out[1], k, t_mid, w + 0.5 * dw, z[SPEED_DELAY], slope, skew)
                    further = x * (drive[k + 1] - drive[k]) if between == ANALOGUE else 0.0
                    asked = z[K_W] * (drive[k] + further - w_meas)
                wanted = min(max(asked, -z[I_MAX]), z[I_MAX])
                i = wanted + (i_end - wanted) * (1.0 - kept) * z[LAG] / h  # mean over the step
                i_end = wanted + (i_end - wanted) * kept
            else:
                u = (drive[k] + share_then(between, x) * (drive[k + 1] - drive[k]) - z[OFFSET]) * gain
                if mode == VOLTAGE:
                    k_e = z[K_E] * emf_factor(z, 0, 1, i, z[DT])
                    L_now = max(z[L] * inductance_factor(z, 0, 1, i), 1e-12)
                    if z[SAG] > 0.0:
                        u = _applied(u, i, z[SAG], z[V_DC])
                    e = u - k_e * (w_b + 0.5 * dw_b if is_driven else w + 0.5 * dw) - lost(z, i)
                    i_next = current_after(i, e, R_now, L_now, h)
                    i, i_end = 0.5 * (i + i_next), i_next
                else:
                    i = u
            tau_m = i if mode == FORCE else z[K_T] * emf_factor(z, 0, 1, i, z[DT]) * i
            # half a step ahead, the speed as it changed in the last step: second order for all but turning round
            theta_mid = theta + 0.5 * h * w
            w_mid = w + 0.5 * dw
            if w_mid * w <= 0.0:
                w_mid = w
            tau = (0.0 if is_driven else tau_m) - torques(z, lines, terms, theta_mid, w_mid, i, t_mid)
            if uneven:
                J_now = max(J_a + inertia * inertia_share(z, 0, 1, theta_mid), LEAST * inertia)
                tau -= 0.5 * inertia * inertia_slope(z, 0, 1, theta_mid) * w_mid * w_mid
            if stiffness > 0.0:
                T = gear_play.through(theta_mid - theta_b - 0.5 * h * w_b, w - w_b, stiffness, damping, gap)
                tau += -T if is_driven else z[LOAD] - T  # the load is beyond the gear too
                pull = T + (tau_m if is_driven else -z[LOAD]) - drag * w_b
                theta_b += 0.5 * h * w_b
                dw_b = rubbing_speed_after(w_b, pull, rubbing, h / J_b) - w_b
                w_b += dw_b
                theta_b += 0.5 * h * w_b
            w_sliding = w_mid if slide == 0.0 else slide * max(w_mid * slide, CREEP)
            F_s, F_d = friction(z, lines, terms, theta_mid, w_sliding, tau, tau_m, i, t_mid, True)
            if friction_memory.is_slow(F_d, deflection, J_now, h):
                bristle = friction_memory.built_up(bristle, 0.5 * h * w, deflection)
                tau -= friction_memory.torque(bristle, w, F_d, deflection, z[BRISTLE_DAMPING], J_now)
                w_next = w + tau * h / J_now
                bristle = friction_memory.built_up(bristle, 0.5 * h * w_next, deflection)
            elif slide == 0.0:
                w_next = speed_after(w, tau, F_s, F_d, h / J_now)
            else:
                w_next = w + (tau - F_d * slide) * h / J_now
            theta += 0.5 * h * (w + w_next)
            dw = w_next - w
            w = w_next
            if mode in (VOLTAGE, SPEED_LOOP):
                i = i_end
        if k == 0:
            slope = (w - out[1, 0]) / span
    _sensors(z, t, skew, slope, out, R_now, mode, drive, gain)


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def _sensors(z, t, skew, slope, out, R_now, mode, drive, gain):
    """Replace what happened by what the sensors show: voltage, resolver error, delays."""
    n = t.shape[0]
    for k in range(n):
        if mode in (VOLTAGE, FORCE):
            out[3, k] = drive[k]
            continue
        i = out[2, k]
        a, b = max(k - 1, 0), min(k + 1, n - 1)
        di = (out[2, b] - out[2, a]) / ((t[b] - t[a]) * skew) if b > a else 0.0
        k_e = z[K_E] * emf_factor(z, 0, 1, i, z[DT])
        u = R_now * i + z[L] * inductance_factor(z, 0, 1, i) * di + k_e * out[3, k] + lost(z, i)
        out[3, k] = _commanded(u, i, z[SAG], z[V_DC]) if z[SAG] > 0.0 else u
    for k in range(n - 1, -1, -1):  # backwards, since the undelayed values of earlier samples are still needed
        theta = out[0, k]
        if z[POSITION_DELAY] > 0.0:
            theta = delayed_position(t, out[0], out[1], k, z[POSITION_DELAY], slope, skew)
        w = delayed(t, out[1], k, z[SPEED_DELAY], slope, skew) if z[SPEED_DELAY] > 0.0 else out[1, k]
        out[0, k] = theta + angle_error(z, 0, 1, theta) + position_error(z, 0, 1, theta)
        out[1, k] = w * (1.0 + _slope(z, theta, False))
        if mode in (CURRENT, SPEED_LOOP):
            out[2, k] = out[2, k] * (1.0 + z[GAIN]) + z[OFFSET]


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def simulate_windows(z, lines, terms, mode, between, offsets, t, drive, load, starts, slide, dT, h_max, out):
    """Simulate windows `offsets[j]:offsets[j + 1]` of the concatenated arrays, each from its own start."""
    for j in range(offsets.shape[0] - 1):
        a, b = offsets[j], offsets[j + 1]
        z[DT] = dT[j]
        window = (t[a:b], drive[a:b], load[a:b], starts[j], slide[j])
        simulate_window(z, lines, terms, mode, between, *window, h_max, out[:, a:b])


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def holding_current(z, lines, terms, theta, direction, t, load, out):
    """Current that holds the axis at rest at angles `theta`, each approached in `direction` (±1).   [A, or N]

    The holding torque lies at the edge of friction on the side from which the angle was approached.
    """
    for k in range(theta.shape[0]):
        i, z[LOAD] = 0.0, load[k]
        for _ in range(3):  # the torque constant and load-dependent friction depend on the current they decide
            k_t = z[K_T] * emf_factor(z, 0, 1, i, z[DT])
            _, F_d = friction(z, lines, terms, theta[k], direction[k] * 1e-9, 0.0, k_t * i, i, t[k], False)
            i = (torques(z, lines, terms, theta[k], direction[k] * 1e-9, i, t[k]) + F_d * direction[k]) / k_t
        out[k] = i * (1.0 + z[GAIN]) + z[OFFSET]


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def _slope(z, theta, of_position):
    """Slope of the error of an angle from which a speed is derived: the resolver's, or the recorded position's."""
    a, b = theta - 1e-3, theta + 1e-3
    ahead = angle_error(z, 0, 1, b) - angle_error(z, 0, 1, a)
    if of_position:
        ahead += position_error(z, 0, 1, b) - position_error(z, 0, 1, a)
    return ahead / 2e-3


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def undo_angle_error(z, measured, of_position, out):
    """True position and speed (n, 2) from measured ones; `of_position`: the speed was derived from the position."""
    for k in range(measured.shape[0]):
        theta = measured[k, 0]
        for _ in range(3):
            theta = measured[k, 0] - angle_error(z, 0, 1, theta) - position_error(z, 0, 1, theta)
        out[k, 0] = theta
        out[k, 1] = measured[k, 1] / (1.0 + _slope(z, theta, of_position))


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def inertia_by_angle(z, theta, out):
    """What the angle adds to the inertia along a motion, and its slope; `out` of shape (2, n_times)."""
    inertia = z[J] * (1.0 + z[INERTIA])
    for k in range(theta.shape[0]):
        out[0, k] = inertia * inertia_share(z, 0, 1, theta[k])
        out[1, k] = inertia * inertia_slope(z, 0, 1, theta[k])


@njit(error_model="numpy", fastmath=True, cache=True, nogil=True)
def torque_along(z, lines, terms, theta, w, i, t, dT, load, is_force, out):
    """What changes the momentum J [1 + Δ(θ)] ω along a measured motion: the drive less everything that opposes it."""
    bristle = 1.0 if w[0] > 0.0 else -1.0
    inertia = z[J] * (1.0 + z[INERTIA])
    for k in range(theta.shape[0]):
        z[DT], z[LOAD] = dT[k], load[k]
        tau_m = i[k] if is_force else z[K_T] * emf_factor(z, 0, 1, i[k], z[DT]) * i[k]
        tau = tau_m - torques(z, lines, terms, theta[k], w[k], i[k], t[k])
        tau += 0.5 * inertia * inertia_slope(z, 0, 1, theta[k]) * w[k] * w[k]
        _, F_d = friction(z, lines, terms, theta[k], w[k], tau, tau_m, i[k], t[k], True)
        if z[DEFLECTION] == 0.0 or (k > 0 and t[k] < t[k - 1]):
            bristle = 1.0 if w[k] > 0.0 else -1.0
        elif k > 0:
            bristle = friction_memory.built_up(bristle, theta[k] - theta[k - 1], z[DEFLECTION])
        out[k] = tau - F_d * bristle
