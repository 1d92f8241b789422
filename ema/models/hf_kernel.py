"""The HF model's equations: one step of one lane, and the loop that runs a batch of lanes in lockstep.

All lanes do the same operations (branches are selects), so the compiler turns the inner loop into vector instructions;
a single run is a batch of one. The number of lanes and the variants are taken from the *lengths* of tuples, which the
compiler knows: ``lanes`` (16 or 1), ``parts`` (the sum of the parts of the library of effects that are compiled in, see
`ema.models.parts`), ``audited`` (1: with energy sums).
"""

from __future__ import annotations

from numba import njit

from ema.core.names import CURRENTS, PHASES
from ema.effects.backlash import creep, deflection, follow
from ema.effects.dry_friction import rubbing_speed_after, speed_after
from ema.effects.inverter import comparator, leg_voltage, share_of_step
from ema.effects.supply_sag import link_voltage
from ema.effects.trapezoid import sector, six_step, trap
from ema.effects.vector_math import TWO_PI, cos, sin

from . import hooks, jit
from .layout import row
from .parts import FRICTION, GEAR, INVERTER, LOCATED, MOTOR, SENSORS, TABLES, TORQUE
from .switching import currents_after, slopes

I_A, I_B, I_C, S_A, S_B, S_C = (row(f"{x}_{j}") for x in "is" for j in PHASES)
OFF_A, OFF_B, OFF_C = (row(f"off_{j}") for j in PHASES)
LAG1_A, LAG1_B, LAG1_C, LAG2_A, LAG2_B, LAG2_C = (row(f"lag{n}_{j}") for n in "12" for j in PHASES)
THETA_M, W_M, THETA_U, W_U, U_DC, ANGLE_ERROR, I_REF = map(
    row, ("theta_m", "w_m", "theta_u", "w_u", "u_dc", "angle_error", "I_ref")
)
THETA_0 = row("theta_0")
R_A, R_B, R_C, L_A, L_B, L_C, K_A, K_B, K_C = (row(f"{x}_{j}") for x in "RLk" for j in PHASES)
P, ZETA, PHI, V_DC, H, I_MAX, J_M, C, F_S, F_D, GR, B, F_U, THETA_STOP = map(
    row, ("p", "zeta", "phi", "V_dc", "h", "I_max", "J_m", "C", "F_s", "F_d", "GR", "b", "F_u", "theta_stop")
)
K_P, K_W, LVDT_STEP, F_LAG, DT = map(row, ("K_p", "K_w", "lvdt_step", "f_lag", "dT"))
E_ELECTRIC, E_COPPER, E_SHAFT, E_FRICTION, E_USER = map(
    row, ("E_electric", "E_copper", "E_shaft", "E_friction", "E_user")
)
COMPLIANCE, INERTIA, DAMPING = (row(f"gear_compliance.{x}") for x in ("compliance", "inertia", "damping"))
USER_DRAG, USER_FRICTION = row("gear_compliance.drag"), row("gear_compliance.friction")
SOURCE_R, SOURCE_C = row("supply_sag.resistance"), row("supply_sag.capacitance")
DEAD_TIME, BELOW, DELAY = map(row, ("dead_time.time", "dead_time.below", "comparator_delay.time"))
COMMUTATION, APART = map(row, ("commutation_offset.angle", "commutation_offset.apart"))
IN_SPEED = row("resolver_error.in_speed")
GAIN_A, GAIN_B, GAIN_C = (row(f"current_gain.gain_{j}") for j in PHASES)
OFFSET_A, OFFSET_B, OFFSET_C = (row(f"current_offset.offset_{j}") for j in PHASES)

# Where the record's channels stand in the output array.
OUTPUTS = (*CURRENTS, "theta_m", "theta_u", "w_m", "u_dc", "I_ref")
THIRD = TWO_PI / 3.0
COS_THIRD, SIN_THIRD = -0.5, 0.75**0.5

_jit = njit(fastmath=jit.FAST, error_model="numpy", forceinline=True)


@_jit
def electrical_step(z, l, N, dt, parts, audited):
    """Advance currents by one step and return the motor torque (the paper's three-phase motor with inverter).

    v_j - v_n = R_j i_j + L_j di_j/dt + κ_j ω_m,   Σ i_j = 0,   τ_m = Σ κ_j i_j
    κ_j = k_e N_j [1 + ζ cos(θ_m + φ - 2πj/3)] trap(p θ_m + θ₀ - 2πj/3)
    """
    i_a, i_b, i_c = z[I_A * N + l], z[I_B * N + l], z[I_C * N + l]
    theta_m, w_m, p, zeta = z[THETA_M * N + l], z[W_M * N + l], z[P * N + l], z[ZETA * N + l]
    theta_e = p * theta_m + z[THETA_0 * N + l]

    # back-EMF and torque coefficients
    c, s = cos(theta_m + z[PHI * N + l]), sin(theta_m + z[PHI * N + l])
    k_a = z[K_A * N + l] * (1.0 + zeta * c) * trap(theta_e)
    k_b = z[K_B * N + l] * (1.0 + zeta * (c * COS_THIRD + s * SIN_THIRD)) * trap(theta_e - THIRD)
    k_c = z[K_C * N + l] * (1.0 + zeta * (c * COS_THIRD - s * SIN_THIRD)) * trap(theta_e + THIRD)
    R_a, R_b, R_c = z[R_A * N + l], z[R_B * N + l], z[R_C * N + l]
    L_a, L_b, L_c = z[L_A * N + l], z[L_B * N + l], z[L_C * N + l]

    # effects on the motor, on what the controller is told, six-step references
    told_a, told_b, told_c = 1.0, 1.0, 1.0
    x_a, x_b, x_c = i_a, i_b, i_c
    if len(parts) & MOTOR:
        dT = z[DT * N + l]
        k_a *= hooks.emf_factor(z, l, N, i_a, dT)
        k_b *= hooks.emf_factor(z, l, N, i_b, dT)
        k_c *= hooks.emf_factor(z, l, N, i_c, dT)
        R = hooks.resistance_factor(z, l, N, dT)
        R_a, R_b, R_c = R * R_a, R * R_b, R * R_c
        L_a *= hooks.inductance_factor(z, l, N, i_a)
        L_b *= hooks.inductance_factor(z, l, N, i_b)
        L_c *= hooks.inductance_factor(z, l, N, i_c)
    if len(parts) & SENSORS:
        told_a, told_b, told_c = 1.0 + z[GAIN_A * N + l], 1.0 + z[GAIN_B * N + l], 1.0 + z[GAIN_C * N + l]
        x_a = told_a * i_a + z[OFFSET_A * N + l]
        x_b = told_b * i_b + z[OFFSET_B * N + l]
        x_c = told_c * i_c + z[OFFSET_C * N + l]
        n = sector(theta_e + p * hooks.angle_error(z, l, N, theta_m) + z[COMMUTATION * N + l])
    else:
        n = sector(theta_e)

    # hysteresis comparators and leg voltages
    I_ref, h = z[I_REF * N + l], z[H * N + l]
    e_a, e_b, e_c = I_ref * six_step(n) - x_a, I_ref * six_step(n - 2.0) - x_b, I_ref * six_step(n + 2.0) - x_c
    u_dc = z[U_DC * N + l] if len(parts) & INVERTER else z[V_DC * N + l]
    if len(parts) & LOCATED:
        currents, legs = (i_a, i_b, i_c), (z[S_A * N + l], z[S_B * N + l], z[S_C * N + l])
        errors, told = (e_a, e_b, e_c), (told_a, told_b, told_c)
        R, L, emf = (R_a, R_b, R_c), (L_a, L_b, L_c), (k_a * w_m, k_b * w_m, k_c * w_m)
        if len(parts) & INVERTER:
            late = (
                z[OFF_A * N + l], z[OFF_B * N + l], z[OFF_C * N + l], z[DELAY * N + l], z[DEAD_TIME * N + l],
                z[BELOW * N + l],
            )  # fmt: skip
            (n_a, n_b, n_c), (s_a, s_b, s_c), off, work, heat = currents_after(
                currents, errors, legs, told, R, L, emf, 0.5 * u_dc, h, dt, late
            )
            z[OFF_A * N + l], z[OFF_B * N + l], z[OFF_C * N + l] = off
        else:
            (n_a, n_b, n_c), (s_a, s_b, s_c), _, work, heat = currents_after(
                currents, errors, legs, told, R, L, emf, 0.5 * u_dc, h, dt, ()
            )
    else:
        s_a = comparator(z[S_A * N + l], e_a, h)
        s_b = comparator(z[S_B * N + l], e_b, h)
        s_c = comparator(z[S_C * N + l], e_c, h)
        if len(parts) & INVERTER:
            dead, below = z[DEAD_TIME * N + l], z[BELOW * N + l]
            on = z[DELAY * N + l] + dead  # from a comparator's decision until the leg is on again
            off_a = on if s_a != z[S_A * N + l] else z[OFF_A * N + l]
            off_b = on if s_b != z[S_B * N + l] else z[OFF_B * N + l]
            off_c = on if s_c != z[S_C * N + l] else z[OFF_C * N + l]
            late_a, late_b, late_c = (
                share_of_step(off_a - dead, dt),
                share_of_step(off_b - dead, dt),
                share_of_step(off_c - dead, dt),
            )
            v_a = leg_voltage(s_a, i_a, u_dc, late_a, share_of_step(off_a, dt) - late_a, below)
            v_b = leg_voltage(s_b, i_b, u_dc, late_b, share_of_step(off_b, dt) - late_b, below)
            v_c = leg_voltage(s_c, i_c, u_dc, late_c, share_of_step(off_c, dt) - late_c, below)
            z[OFF_A * N + l] = max(off_a - dt, 0.0)
            z[OFF_B * N + l] = max(off_b - dt, 0.0)
            z[OFF_C * N + l] = max(off_c - dt, 0.0)
        else:
            v_a, v_b, v_c = 0.5 * u_dc * s_a, 0.5 * u_dc * s_b, 0.5 * u_dc * s_c
        d_a, d_b = slopes(
            v_a - R_a * i_a - k_a * w_m,
            v_b - R_b * i_b - k_b * w_m,
            v_c - R_c * i_c - k_c * w_m,
            L_a,
            L_b,
            L_c,
            dt / (L_a * L_b + L_b * L_c + L_c * L_a),
        )
        n_a, n_b = i_a + d_a, i_b + d_b
        n_c = -n_a - n_b
        m_a, m_b, m_c = 0.5 * (i_a + n_a), 0.5 * (i_b + n_b), 0.5 * (i_c + n_c)
        work = dt * (v_a * m_a + v_b * m_b + v_c * m_c)
        heat = dt * (R_a * i_a * m_a + R_b * i_b * m_b + R_c * i_c * m_c)
    if len(parts) & INVERTER:
        i_dc = 0.5 * (s_a * i_a + s_b * i_b + s_c * i_c)
        z[U_DC * N + l] = link_voltage(u_dc, z[V_DC * N + l], i_dc, z[SOURCE_R * N + l], z[SOURCE_C * N + l], dt)
    z[S_A * N + l], z[S_B * N + l], z[S_C * N + l] = s_a, s_b, s_c
    z[I_A * N + l], z[I_B * N + l], z[I_C * N + l] = n_a, n_b, n_c

    # measured currents through two first-order anti-alias stages
    g = min(TWO_PI * z[F_LAG * N + l] * dt, 1.0)  # one: no filter that a step could resolve
    z[LAG1_A * N + l] += g * (x_a - z[LAG1_A * N + l])
    z[LAG1_B * N + l] += g * (x_b - z[LAG1_B * N + l])
    z[LAG1_C * N + l] += g * (x_c - z[LAG1_C * N + l])
    z[LAG2_A * N + l] += g * (z[LAG1_A * N + l] - z[LAG2_A * N + l])
    z[LAG2_B * N + l] += g * (z[LAG1_B * N + l] - z[LAG2_B * N + l])
    z[LAG2_C * N + l] += g * (z[LAG1_C * N + l] - z[LAG2_C * N + l])

    if len(audited):  # with the currents in the middle of the step, so that ½ L i² is accounted for exactly
        z[E_ELECTRIC * N + l] += work
        z[E_COPPER * N + l] += heat
    return k_a * n_a + k_b * n_b + k_c * n_c


@_jit
def mechanical_step(z, l, N, dt, tau_m, parts, audited):
    """Advance rotor and user by one step: J_m dω_m/dt = τ_m - C ω_m - τ_friction(ω_m, τ) - τ_load/GR."""
    theta_m, w_m, theta_u, gr = z[THETA_M * N + l], z[W_M * N + l], z[THETA_U * N + l], z[GR * N + l]
    b, stop, J_m = z[B * N + l], z[THETA_STOP * N + l], z[J_M * N + l]
    F_s, F_d = z[F_S * N + l], z[F_D * N + l]
    tau = tau_m - z[C * N + l] * w_m
    i_q = 0.5 * (abs(z[I_A * N + l]) + abs(z[I_B * N + l]) + abs(z[I_C * N + l]))
    tau_user = 0.0
    if len(parts) & TORQUE:
        tau_user = hooks.user_torque(z, l, N, theta_u)
        tau -= hooks.shaft_torque(z, l, N, theta_m, w_m, theta_u, i_q)
    if len(parts) & TABLES:
        tau -= hooks.tabulated_torque(z, l, N, theta_m, w_m, theta_u, i_q)
    if len(parts) & GEAR:  # a spring with the user's own inertia behind it; stiff where it does not give
        compliance = z[COMPLIANCE * N + l]
        soft = compliance > 0.0
        K = 1.0 / (compliance if soft else 1.0)
        J_u, w_u = z[INERTIA * N + l], z[W_U * N + l]
        twist = deflection(theta_u, theta_m / gr, b)
        damper = 2.0 * z[DAMPING * N + l] * (K * J_u) ** 0.5 * (w_m / gr - w_u)
        tau_gear = K * twist + (damper if twist != 0.0 else 0.0)
        tau -= (tau_gear if soft else tau_user) / gr
    elif len(parts) & TORQUE:  # the user's load acts at once
        tau -= tau_user / gr
    if len(parts) & FRICTION:
        direction = 1.0 if (w_m if w_m != 0.0 else tau) > 0.0 else -1.0
        F_s *= hooks.static_friction(z, l, N, theta_m, w_m, theta_u, direction, tau_m)
        F_d *= hooks.sliding_friction(z, l, N, theta_m, w_m, theta_u, direction, tau_m)

    w_next = speed_after(w_m, tau, F_s, F_d, dt / J_m)
    theta_next = theta_m + w_next * dt

    # end of travel: the rotor is stopped dead where the gap is closed against the stop
    limit = gr * (stop + b)
    w_next = 0.0 if abs(theta_next) > limit else w_next
    theta_next = min(max(theta_next, -limit), limit)

    crept = theta_u - dt * creep(tau_user, z[F_U * N + l])
    if len(parts) & GEAR:
        tau_u = tau_gear - tau_user - z[USER_DRAG * N + l] * w_u
        w_u_next = rubbing_speed_after(w_u, tau_u, z[USER_FRICTION * N + l], dt / J_u)
        theta_soft = min(max(theta_u + w_u_next * dt, -stop), stop)
        w_u_next = w_u_next if abs(theta_soft) < stop else 0.0
        z[W_U * N + l] = w_u_next if soft else w_next / gr
        theta_u_next = theta_soft if soft else min(max(follow(crept, theta_next / gr, b), -stop), stop)
    else:
        theta_u_next = min(max(follow(crept, theta_next / gr, b), -stop), stop)
    z[THETA_M * N + l], z[W_M * N + l], z[THETA_U * N + l] = theta_next, w_next, theta_u_next

    if len(audited):
        w_mid = 0.5 * (w_m + w_next)
        z[E_SHAFT * N + l] += dt * tau_m * w_mid
        z[E_FRICTION * N + l] += dt * (tau * w_mid - J_m * (w_next * w_next - w_m * w_m) / (2.0 * dt))
        z[E_USER * N + l] += dt * (tau_m - tau) * w_mid


@_jit
def control(z, l, N, theta_cmd, theta_u_meas, w_m_meas):
    """Cascade of two proportional controllers: position → speed → reference current.

    ω_ref = K_p (θ_cmd - θ_u),   I_ref = sat(K_w (ω_ref - ω_m), ±I_max)
    """
    w_ref = z[K_P * N + l] * (theta_cmd - theta_u_meas)
    I_max = z[I_MAX * N + l]
    z[I_REF * N + l] = min(max(z[K_W * N + l] * (w_ref - w_m_meas), -I_max), I_max)


@_jit
def delayed(history, tick, l, delay_ticks):
    """Value of a signal a (fractional) number of control ticks ago, from its ring buffer (n_ring, n_lanes)."""
    n_ring = history.shape[0]
    d = min(max(delay_ticks, 0.0), float(n_ring - 2))
    whole = int(d)
    share = d - whole
    older = tick - whole - 1
    newer = tick - whole
    return (1.0 - share) * history[max(newer, 0) % n_ring, l] + share * history[max(older, 0) % n_ring, l]


POSITION_DELAY, SPEED_DELAY = row("position_delay.time"), row("speed_delay.time")
CONTROLLER_DELAY = row("controller_delay.time")  # behind the recorder's tap


@njit(fastmath=jit.FAST, error_model="numpy", cache=True, nogil=True)
def integrate(z, command, lvdt_noise, out, history, dt, n_substeps, lanes, parts, audited):
    """Run a batch of lanes from the state in `z` over all ticks of `command`.

    Parameters
    ----------
    z : array, shape (N_ROWS * n_lanes,)
        State, parameters and effects; the state is advanced in place.
    command, lvdt_noise : arrays, shape (n_ticks, n_lanes)
        Commanded user position and noise of its measurement at each control tick. [rad]
    out : array, shape (len(OUTPUTS), n_ticks, n_lanes)
        Filled with the channels at each tick: currents behind the anti-alias stages, positions as measured.
    history : array, shape (2, n_ring, n_lanes)
        Ring buffers of measured position and speed, for the delays.
    dt : float
        Step. [s]
    n_substeps : int
        Steps from one control tick to the next.
    parts : tuple
        As long as the sum of what of the library of effects acts (`ema.models.parts`).
    """
    N = len(lanes)
    n_ticks = command.shape[0]
    T = dt * n_substeps
    for tick in range(n_ticks):
        for l in range(N):
            step = z[LVDT_STEP * N + l]
            theta_u_meas = step * round((z[THETA_U * N + l] + lvdt_noise[tick, l]) / step)
            theta_u_seen = theta_u_meas  # by the controller
            theta_m_meas, w_m_meas = z[THETA_M * N + l], z[W_M * N + l]
            if len(parts) & SENSORS:
                zero = (z[COMMUTATION * N + l] - z[APART * N + l]) / z[P * N + l]
                error = hooks.angle_error(z, l, N, theta_m_meas) + zero
                rate = (error - z[ANGLE_ERROR * N + l]) / T if tick > 0 else 0.0
                w_m_meas += z[IN_SPEED * N + l] * rate
                z[ANGLE_ERROR * N + l] = error
                theta_m_meas += error
                history[0, tick % history.shape[1], l] = theta_u_meas
                history[1, tick % history.shape[1], l] = w_m_meas
                late = z[POSITION_DELAY * N + l]
                theta_u_meas = delayed(history[0], tick, l, late / T)
                theta_u_seen = delayed(history[0], tick, l, (late + z[CONTROLLER_DELAY * N + l]) / T)
                w_m_meas = delayed(history[1], tick, l, z[SPEED_DELAY * N + l] / T)
            control(z, l, N, command[tick, l], theta_u_seen, w_m_meas)
            out[0, tick, l] = z[LAG2_A * N + l]
            out[1, tick, l] = z[LAG2_B * N + l]
            out[2, tick, l] = z[LAG2_C * N + l]
            out[3, tick, l] = theta_m_meas
            out[4, tick, l] = theta_u_meas
            out[5, tick, l] = w_m_meas
            out[6, tick, l] = z[U_DC * N + l]
            out[7, tick, l] = z[I_REF * N + l]
        if tick < n_ticks - 1:
            for _ in range(n_substeps):
                for l in range(N):
                    tau_m = electrical_step(z, l, N, dt, parts, audited)
                    mechanical_step(z, l, N, dt, tau_m, parts, audited)
