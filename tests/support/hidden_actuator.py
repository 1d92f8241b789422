"""A second, independent simulation of the three-phase actuator, written from its description, with flaws to hide.

Shares no code with `ema`: the finder is tested on data it did not make. Equations: wye-connected motor with floating
neutral and trapezoidal coefficients, hysteresis current control at 1 µs, four-state dry friction, backlash, cascade
control at 10 kHz, two 2 kHz anti-alias stages, 12-bit current ADC. Where physics allows, flaws have another functional
form than the library's effects (see `Flaws`). The bench (`Bench`) draws its own motions, noise, integration step and
position.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

TICK = 1e-4  # [s]


class Nominal(NamedTuple):
    """What the finder is told of the plant: that of `config/actuator.yaml`, or another."""

    R: float = 1.065  # [ohm]
    L: float = 0.36e-3  # [H]
    k_e: float = 0.0376  # [V s/rad]
    p: float = 2.0
    J: float = 2.5e-5  # [kg m²]
    C: float = 3e-5  # [N m s/rad]
    V: float = 48.0  # [V]
    h: float = 0.25  # [A]
    I_max: float = 22.5  # [A]
    GR: float = 500.0
    F_s: float = 0.04  # [N m]
    F_d: float = 0.02  # [N m]
    b: float = 1e-5  # [rad]
    K_p: float = 6e4  # [1/s]
    K_w: float = 0.05  # [A s/rad]


# More than a factor of two apart in inertia, friction, inductance and gear; loops as fast as those of the first.
PLANTS = {
    "shipped": Nominal(),
    "heavy": Nominal(R=0.7, L=0.8e-3, k_e=0.05, p=4.0, J=7e-5, C=8e-5, V=60.0, GR=220.0, F_s=0.1, F_d=0.06, b=2.2e-5,
                     K_p=2.6e4, K_w=0.105),
    "light": Nominal(R=1.9, L=0.17e-3, k_e=0.028, p=2.0, J=1.1e-5, C=1e-5, h=0.35, I_max=18.0, GR=1050.0, F_s=0.016,
                     F_d=0.009, b=5e-6, K_p=1.26e5, K_w=0.03),
}  # fmt: skip


class Flaws(NamedTuple):
    """What this actuator does that the finder's nominal plant does not; zero is no flaw."""

    # faults
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    phi: float = 0.0  # [rad] direction of the eccentricity
    # motor and inverter
    flux: float = 0.0  # relative change
    resistance: float = 0.0  # relative change
    dead_time: float = 0.0  # [s]
    soft_current: float = 0.0  # [A] in dead time a leg lies between as tanh(i/i_0): the switches have capacitances
    reaction: float = 0.0  # [s] comparators see currents and references of that long ago
    source_resistance: float = 0.0  # [ohm], DC link of 2 mF instead of a first-order lag
    saturation_current: float = 0.0  # [A] κ and L fall as tanh(i/i_s)/(i/i_s); 0: never
    first_ampere: float = 0.0  # [A] κ and L fall as 1/(1 + |i|/i_s); 0: never
    corner: float = 2000.0  # [Hz] of the recorder's two anti-alias stages
    commutation: float = 0.0  # [rad electrical]
    commutation_apart: float = 0.0  # [rad electrical] the part of it that the recorded rotor angle does not have
    # mechanics
    viscous: float = 0.0  # [N m s/rad]
    quadratic: float = 0.0  # [N m s²/rad²]
    stribeck: float = 0.0  # Tustin's law with a Gaussian: F_d (1 + s exp(-(ω/ω_s)²))
    stribeck_speed: float = 20.0
    asymmetry: float = 0.0
    bump: float = 0.0  # friction higher by a raised cosine over ±bump_width around bump_centre [rad at the user]
    bump_centre: float = 0.0
    bump_width: float = 2e-3
    load_friction: float = 0.0  # [1/(N m)]
    cogging: float = 0.0  # [N m] first line; the second has a fifth of it at twice the order
    cogging_order: float = 12.0
    cogging_phase: float = 0.0
    load: float = 0.0  # [N m at the user]
    spring: float = 0.0  # [N m/rad at the user]
    holding: float = 1e9  # [N m] friction at the user: a load beyond it presses the user to one side of the play
    compliance: float = 0.0  # [rad/(N m)] with the user's own inertia and a viscous damper
    user_inertia: float = 0.6
    user_damping: float = 0.0  # [N m s/rad]
    user_drag: float = 0.0  # [N m s/rad] against the fixed world
    user_rubbing: float = 0.0  # [N m] dry, smooth within 1 mrad/s
    # sensors
    gain_a: float = 0.0
    gain_b: float = 0.0
    gain_c: float = 0.0
    offset_a: float = 0.0
    offset_b: float = 0.0
    offset_c: float = 0.0
    once_cosine: float = 0.0
    once_sine: float = 0.0
    twice_cosine: float = 0.0
    twice_sine: float = 0.0
    tachometer: float = 0.0  # 1: the speed has a sensor of its own, without the resolver's error
    position_delay: float = 0.0  # [s]
    speed_delay: float = 0.0  # [s]
    clock_skew: float = 0.0  # the recorder's interval is longer by this share
    adc_limit: float = 30.0  # [A]
    controller_delay: float = 0.0  # [s] of the user position, behind the recorder's tap
    # the recorder alone: the controller sees none of it
    recorder_gain_a: float = 0.0
    recorder_gain_b: float = 0.0
    recorder_gain_c: float = 0.0
    recorder_offset_a: float = 0.0
    recorder_offset_b: float = 0.0
    recorder_offset_c: float = 0.0
    recorder_delay: float = 0.0  # [s] of the user position
    # outside the library
    cushion: float = 0.0  # [N m/rad² at the user] a spring that stiffens from cushion_begin on
    cushion_begin: float = 1e-3  # [rad at the user]
    line: float = 0.0  # [N m] torque line at a non-integer order
    line_order: float = 7.37
    drag: float = 0.0  # [N m] additional dry friction that comes and goes with time
    drag_period: float = 0.11  # [s]
    deadband: float = 0.0  # [rad] the controller ignores smaller position errors
    slew: float = 0.0  # [A/s] limit on the reference current
    hum: float = 0.0  # [A] on phase A's measurement
    hum_frequency: float = 187.0  # [Hz]
    shaker: float = 0.0  # [N m] torque at a fixed frequency
    shaker_frequency: float = 83.0  # [Hz]
    weak_leg: float = 0.0  # share of switching commands to "up" that leg B ignores, until the next control tick
    inertia: float = 0.0  # relative change of the rotor's inertia
    speed_gain: float = 0.0  # relative change of the speed loop's gain
    bristle: float = 0.0  # [rad] friction has a memory: bristles give way so far before they slide (LuGre)
    integral: float = 0.0  # [1/s] the speed loop integrates its error too


class Bench(NamedTuple):
    """What the finder must not mind."""

    current_noise: float = 5e-3  # [A] rms
    lvdt_noise: float = 4e-6  # [rad] rms
    substeps: int = 100  # integration steps in a control tick
    position: float = 0.0  # [rad] at the user, around which everything moves
    user_zero: float = 0.0  # [rad] what the user's sensor shows at zero; commands are by this sensor
    command_late: int = 0  # 1: the recorder writes the state at the end of a tick beside the command of its beginning
    nominal: Nominal = PLANTS["shipped"]


BENCH = Bench()


class State(NamedTuple):
    """At rest or in motion, at the end of a cycle."""

    i: np.ndarray
    filtered: np.ndarray  # (2, 3)
    switch: np.ndarray
    mechanics: np.ndarray  # theta_m, w_m, theta_u, w_u
    u_dc: np.ndarray


def rest(position: float = 0.0, nominal: Nominal = BENCH.nominal) -> State:
    mechanics = np.array([nominal.GR * position, 0.0, position, 0.0])
    return State(np.zeros(3), np.zeros((2, 3)), np.ones(3), mechanics, np.array([nominal.V]))


@numba.njit(cache=True)
def _trapezoid(angle):
    x = (angle / (2.0 * math.pi)) % 1.0  # 0…1, as the sine
    if x < 0.25:
        y = 12.0 * x
    elif x < 0.75:
        y = 6.0 - 12.0 * x
    else:
        y = 12.0 * x - 12.0
    return min(max(y, -1.0), 1.0)


@numba.njit(cache=True)
def _commutated(angle):
    x = (angle / (2.0 * math.pi)) % 1.0
    if 1.0 / 12.0 <= x <= 5.0 / 12.0:
        return 1.0
    if 7.0 / 12.0 <= x <= 11.0 / 12.0:
        return -1.0
    return 0.0


@numba.njit(cache=True)
def _loss(x):
    """tanh(x)/x"""
    return 1.0 if abs(x) < 1e-4 else math.tanh(x) / x


@numba.njit(cache=True)
def _run(q, f, command, lvdt_noise, substeps, t0, rng_switch, i, flt, sw, mech, link, out):
    R, L, k_e, p, J, C = q.R, q.L, q.k_e, q.p, q.J * (1.0 + f.inertia), q.C
    V, h, I_max, GR, K_p, K_w = q.V, q.h, q.I_max, q.GR, q.K_p, q.K_w * (1.0 + f.speed_gain)
    F_s, F_d = q.F_s * (1.0 + 3.0 * f.k1), q.F_d * (1.0 + 3.0 * f.k1)
    b, stop, lsb = q.b * (1.0 + 100.0 * f.k2), 0.4, 1.5e-5
    N = np.array([1.0 - f.k3, 1.0 - f.k4, 1.0 - f.k5])
    gains = np.array([1.0 + f.gain_a, 1.0 + f.gain_b, 1.0 + f.gain_c])
    offsets = np.array([f.offset_a, f.offset_b, f.offset_c])
    shift = np.array([0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0])
    blank = np.zeros(3)
    kappa, v, x, di, Lj, Rj = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    n = len(command)
    log_u, log_w = np.zeros(n), np.zeros(n)
    T = TICK * (1.0 + f.clock_skew)
    dt = T / substeps
    I_ref, last_error = 0.0, 0.0
    bent, summed = 0.0, 0.0  # bristles' deflection [rad]; integral of the speed loop's error [rad]
    wishes, at = np.zeros((64, 3)), 0
    draw, deaf = 0, -1
    for tick in range(n):
        theta, w, theta_u, w_u = mech[0], mech[1], mech[2], mech[3]
        error = (
            f.once_cosine * math.cos(theta)
            + f.once_sine * math.sin(theta)
            + f.twice_cosine * math.cos(2.0 * theta)
            + f.twice_sine * math.sin(2.0 * theta)
            + (f.commutation - f.commutation_apart) / p
        )
        seen_w = w + ((1.0 - f.tachometer) * (error - last_error) / T if tick > 0 else 0.0)
        last_error = error
        log_u[tick] = lsb * math.floor((theta_u + lvdt_noise[tick]) / lsb + 0.5)
        log_w[tick] = seen_w
        late_u, late_w = tick - f.position_delay / T, tick - f.speed_delay / T
        lower = max(math.floor(late_u), 0)
        upper = min(lower + 1, tick)
        seen_u = log_u[lower] + (max(late_u, 0.0) - lower) * (log_u[upper] - log_u[lower])
        lower = max(math.floor(late_w), 0)
        upper = min(lower + 1, tick)
        seen_w = log_w[lower] + (max(late_w, 0.0) - lower) * (log_w[upper] - log_w[lower])
        late_u -= f.controller_delay / T
        lower = max(math.floor(late_u), 0)
        upper = min(lower + 1, tick)
        lag = command[tick] - (log_u[lower] + (max(late_u, 0.0) - lower) * (log_u[upper] - log_u[lower]))
        if f.deadband > 0.0:
            lag = 0.0 if abs(lag) < f.deadband else lag - math.copysign(f.deadband, lag)
        slow = K_p * lag - seen_w
        wanted = K_w * (slow + f.integral * summed)
        if abs(wanted) < I_max:
            summed += T * slow
        wanted = min(max(wanted, -I_max), I_max)
        if f.slew > 0.0:
            wanted = min(max(wanted, I_ref - f.slew * T), I_ref + f.slew * T)
        I_ref = wanted
        for j in range(3):
            out[j, tick] = flt[1, j]
        out[3, tick], out[4, tick], out[5, tick] = theta + error, seen_u, link[0]
        if tick == n - 1:
            break
        for sub in range(substeps):
            theta, w, theta_u, w_u = mech[0], mech[1], mech[2], mech[3]
            now = t0 + tick * T + sub * dt
            # the motor
            seen = (
                p
                * (
                    theta
                    + f.once_cosine * math.cos(theta)
                    + f.once_sine * math.sin(theta)
                    + f.twice_cosine * math.cos(2.0 * theta)
                    + f.twice_sine * math.sin(2.0 * theta)
                )
                + f.commutation
            )
            for j in range(3):
                kappa[j] = k_e * (1.0 + f.flux) * N[j] * (1.0 + f.k6 * math.cos(theta + f.phi - shift[j]))
                kappa[j] *= _trapezoid(p * theta - shift[j])
                Lj[j], Rj[j] = L * N[j] * N[j], R * N[j] * (1.0 + f.resistance)
                loss = 1.0
                if f.saturation_current > 0.0:
                    loss = _loss(i[j] / f.saturation_current)
                if f.first_ampere > 0.0:
                    loss /= 1.0 + abs(i[j]) / f.first_ampere
                kappa[j] *= loss
                Lj[j] *= loss
                x[j] = gains[j] * i[j] + offsets[j]
                if j == 0 and f.hum != 0.0:
                    x[j] += f.hum * math.sin(2.0 * math.pi * f.hum_frequency * now)
                wish = I_ref * _commutated(seen - shift[j]) - x[j]
                if f.reaction > 0.0:
                    wishes[at % 64, j] = wish
                    back = min(f.reaction / dt, 62.0)
                    older, share = at - int(back) - 1, back - int(back)
                    wish = (1.0 - share) * wishes[(older + 1) % 64, j] + share * wishes[older % 64, j]
                previous = sw[j]
                if wish > h:
                    sw[j] = 1.0
                elif wish < -h:
                    sw[j] = -1.0
                if j == 1 and f.weak_leg > 0.0 and sw[j] > previous:
                    if deaf != tick:
                        draw = (draw + 1) % len(rng_switch)
                        deaf = tick if rng_switch[draw] < f.weak_leg else -1
                    if deaf == tick:
                        sw[j] = -1.0
                if sw[j] != previous:
                    blank[j] = f.dead_time
                dead = min(blank[j], dt) / dt
                blank[j] = max(blank[j] - dt, 0.0)
                diode = -1.0 if i[j] > 0.0 else 1.0
                if f.soft_current > 0.0:
                    diode = -math.tanh(i[j] / f.soft_current)
                v[j] = 0.5 * link[0] * ((1.0 - dead) * sw[j] + dead * diode)
            e0 = v[0] - Rj[0] * i[0] - kappa[0] * w
            e1 = v[1] - Rj[1] * i[1] - kappa[1] * w
            e2 = v[2] - Rj[2] * i[2] - kappa[2] * w
            neutral = (e0 / Lj[0] + e1 / Lj[1] + e2 / Lj[2]) / (1.0 / Lj[0] + 1.0 / Lj[1] + 1.0 / Lj[2])
            i_dc = 0.5 * (sw[0] * i[0] + sw[1] * i[1] + sw[2] * i[2])
            if f.source_resistance > 0.0:
                link[0] += dt / 2e-3 * ((V - link[0]) / f.source_resistance - i_dc)
            di[0], di[1], di[2] = (e0 - neutral) / Lj[0], (e1 - neutral) / Lj[1], (e2 - neutral) / Lj[2]
            torque = 0.0
            for j in range(3):
                i[j] += dt * di[j]
                torque += kappa[j] * i[j]
                flt[0, j] += 2.0 * math.pi * f.corner * dt * (x[j] - flt[0, j])
                flt[1, j] += 2.0 * math.pi * f.corner * dt * (flt[0, j] - flt[1, j])
            at += 1
            # the mechanics
            drive = torque - C * w - f.viscous * w - f.quadratic * abs(w) * w
            drive -= f.cogging * math.sin(f.cogging_order * theta + f.cogging_phase)
            drive -= 0.2 * f.cogging * math.sin(2.0 * f.cogging_order * theta)
            drive -= f.line * math.sin(f.line_order * theta)
            drive -= f.shaker * math.sin(2.0 * math.pi * f.shaker_frequency * now)
            gear_torque = f.load + f.spring * theta_u + f.cushion * max(theta_u - f.cushion_begin, 0.0) ** 2
            twist = 0.0
            if f.compliance > 0.0:
                gap = theta / GR - theta_u
                twist = gap - min(max(gap, -b), b)
                gear_torque = twist / f.compliance
                if twist != 0.0:
                    gear_torque += f.user_damping * (w / GR - w_u)
            drive -= gear_torque / GR
            way = w if w != 0.0 else drive
            direction = 1.0 if way > 0.0 else -1.0
            factor = 1.0 + f.asymmetry * direction
            factor *= 1.0 + f.load_friction * abs(torque)
            if f.bump != 0.0 and abs(theta_u - f.bump_centre) < f.bump_width:
                factor *= 1.0 + 0.5 * f.bump * (1.0 + math.cos(math.pi * (theta_u - f.bump_centre) / f.bump_width))
            extra = f.drag if f.drag > 0.0 and (now / f.drag_period) % 1.0 < 0.35 else 0.0
            if f.bristle > 0.0:  # Canudas de Wit et al., IEEE Trans. Autom. Control 40, 1995
                level = factor * (F_d + (F_s - F_d) * math.exp(-((w / 2.0) ** 2))) + extra
                stiffness = level / f.bristle
                give = w - abs(w) * bent / f.bristle
                bent += dt * give
                net = drive - stiffness * bent - 0.3 * math.sqrt(stiffness * J) * give
            elif w == 0.0:
                hold = F_s * factor + extra
                net = 0.0 if abs(drive) <= hold else drive - math.copysign(hold, drive)
            else:
                slide = F_d * factor * (1.0 + f.stribeck * math.exp(-((w / f.stribeck_speed) ** 2))) + extra
                net = drive - math.copysign(slide, w)
            faster = w + dt / J * net
            if faster * w < 0.0 and f.bristle == 0.0:
                faster = 0.0
            theta += dt * faster
            end = GR * (stop + b)
            if abs(theta) > end:
                theta, faster = math.copysign(end, theta), 0.0
            mech[0], mech[1] = theta, faster
            if f.compliance > 0.0:
                rubbing = f.user_drag * w_u + f.user_rubbing * math.tanh(w_u / 1e-3)
                w_u += dt / f.user_inertia * (gear_torque - f.load - f.spring * theta_u - rubbing)
                theta_u += dt * w_u
            else:
                theta_u = min(max(theta_u, theta / GR - b), theta / GR + b)
                if abs(gear_torque) > f.holding:
                    theta_u = theta / GR - math.copysign(b, gear_torque)
                w_u = faster / GR
            mech[2], mech[3] = theta_u, w_u


def cycle(flaws: Flaws, command: np.ndarray, state: State, seed: int, bench: Bench = BENCH) -> dict[str, np.ndarray]:
    """One recorded cycle at 10 kHz; `state` is advanced. Channels by name."""
    rng = np.random.default_rng(seed)
    n, late = len(command), bench.command_late
    out = np.zeros((6, n + late))
    flaws = Flaws(*(float(x) for x in flaws))
    acted = np.append(np.asarray(command, dtype=float), np.repeat(command[-1], late))
    _run(
        *(bench.nominal, flaws, acted, bench.lvdt_noise * rng.standard_normal(n + late)),
        *(
            bench.substeps,
            10.0 * rng.random(),
            rng.random(4096),
            state.i,
            state.filtered,
            state.switch,
            state.mechanics,
            state.u_dc,
            out,
        ),
    )
    out = np.ascontiguousarray(out[:, late:])
    gain = np.array([flaws.recorder_gain_a, flaws.recorder_gain_b, flaws.recorder_gain_c])[:, None]
    offset = np.array([flaws.recorder_offset_a, flaws.recorder_offset_b, flaws.recorder_offset_c])[:, None]
    out[:3] = out[:3] * (1.0 + gain) + offset
    if flaws.recorder_delay > 0.0:
        tick = np.arange(n)
        out[4] = np.interp(tick - flaws.recorder_delay / TICK, tick, out[4])
    i = np.clip(out[:3] + bench.current_noise * rng.standard_normal((3, n)), -flaws.adc_limit, flaws.adc_limit)
    step = 60.0 / 4096
    i = step * np.round(i / step)
    names = ("i_a", "i_b", "i_c")
    return {
        "t": np.arange(n) * 1e-4,
        **dict(zip(names, i, strict=True)),
        "theta_m": out[3],
        "theta_u": out[4] + bench.user_zero,
        "theta_cmd": np.array(command) + bench.user_zero,
        "u_dc": out[5],
    }


def chirp(amplitude: float = 5e-3, f_end: float = 15.0, duration: float = 0.5) -> np.ndarray:
    t = _times(duration)
    return amplitude * np.sin(np.pi * f_end * t**2 / duration)


def _times(duration: float) -> np.ndarray:
    return np.arange(round(duration * 1e4) + 1) / 1e4


MOTIONS = (chirp(), chirp(0.02, 3.0))  # fast and short; slow over three rotor turns


def sine(amplitude: float, f: float, duration: float) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * f * _times(duration))


def triangle(amplitude: float, f: float, duration: float) -> np.ndarray:
    return amplitude * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * f * _times(duration)))


def steps(amplitude: float, f: float, duration: float) -> np.ndarray:
    """Steps up, back, down, back; held for a quarter of a period each."""
    return amplitude * np.round(np.sin(2.0 * np.pi * f * _times(duration) + 1e-9))


def ramps(amplitude: float, f: float, duration: float) -> np.ndarray:
    """Ramps with holds between them."""
    return np.clip(1.6 * triangle(amplitude, f, duration), -amplitude, amplitude)


def two_tones(amplitude: float, f: float, duration: float) -> np.ndarray:
    return 0.6 * sine(amplitude, 0.4 * f, duration) + 0.4 * sine(amplitude, 1.3 * f, duration)


SHAPES = (chirp, sine, triangle, steps, ramps, two_tones)


def drawn_motion(rng: np.random.Generator, GR: float = 500.0) -> np.ndarray:
    """Another shape, amplitude and pace: rotor speeds of 60 to 230 rad/s, amplitudes of half to four rotor turns."""
    shape = SHAPES[int(rng.integers(len(SHAPES)))]
    amplitude = float(np.exp(rng.uniform(np.log(2e-3), np.log(2e-2)))) * 500.0 / GR
    f = float(rng.uniform(60.0, 230.0)) / (2.0 * np.pi * amplitude * GR)
    duration = max(0.5, 1.2 / f) if shape is not chirp else 0.5
    return np.round(shape(amplitude, min(f, 20.0), min(duration, 0.8)), 7)


def drawn_motions(rng: np.random.Generator, GR: float = 500.0) -> tuple[np.ndarray, ...]:
    """The test chirps, one motion only, two or three others in turn, or many that are all different."""
    kind = rng.choice(["test", "one", "some", "many"], p=[0.3, 0.2, 0.35, 0.15])
    if kind == "test":
        return tuple(500.0 / GR * motion for motion in MOTIONS)
    return tuple(drawn_motion(rng, GR) for _ in range({"one": 1, "some": int(rng.integers(2, 4)), "many": 6}[kind]))


def drawn_bench(rng: np.random.Generator) -> Bench:
    """Noise, step and place of a bench that is not ours."""
    return Bench(
        float(rng.uniform(3e-3, 7e-3)), float(rng.uniform(2e-6, 6e-6)), int(rng.choice([100, 200])),
        float(rng.choice([0.0, rng.uniform(-0.1, 0.1)])),
    )  # fmt: skip


def cycles(
    flaws: Flaws,
    n: int = 6,
    seed: int = 0,
    motions: tuple[np.ndarray, ...] = MOTIONS,
    bench: Bench = BENCH,
) -> list[dict[str, np.ndarray]]:
    """`n` consecutive cycles, motions in turn; between cycles the actuator is led back and comes to rest."""
    found, state = [], rest(bench.position, bench.nominal)
    _ = cycle(flaws, np.full(500, bench.position), state, 1000 * seed + 999, bench)
    for number in range(n):
        command = bench.position + motions[number % len(motions)]
        found.append(cycle(flaws, command, state, 1000 * seed + number, bench))
        back = bench.position + motions[number % len(motions)][-1] * np.linspace(1.0, 0.0, 2000) ** 2
        rested = np.concatenate([back, np.full(500, bench.position)])
        _ = cycle(flaws, rested, state, 1000 * seed + 500 + number, bench)
    return found
