"""Benches with a position loop: a positioning table, and a servo with a pendulum. Shares no code with the models.

Fine steps of Euler's rule, positions by the mean speed of a step: by the speed at its end they would run half a step
ahead, which records of low noise show. Dry friction is the smallest force that stops the axis within a step. The
controllers act on what an encoder counts, and hold what they ask for until the next sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record


@dataclass(frozen=True)
class Table:
    """A mass under a cascade of position and speed, as a commercial drive has it; forces in N."""

    M: float = 90.0
    F_d: float = 20.0
    C_positive: float = 200.0
    C_negative: float = 200.0
    constant: float = 0.0
    quadratic: float = 0.0
    spring: float = 0.0
    stribeck: float = 0.0  # [N] more at rest, fading over 0.02 m/s
    gain: float = 35.0  # [N/V] of the drive
    counts: float = 2e-6  # [m]
    ripple: float = 0.1  # [N] rms of the recorded force
    hz: int = 1000
    magnets: tuple[tuple[float, float, float], ...] = ()  # force [N], period [m] and phase, the linear motor's own
    tight: tuple[float, float, float] = (0.0, 0.0, 0.0)  # from here to there [m] dry friction is so much more [N]


@njit(cache=True)
def _table(reference, hz, M, F_d, Cp, Cn, constant, quadratic, spring, stribeck, counts, noise, magnets, tight, out):
    q, v, fine = 0.0, 0.0, 40
    dt = 1.0 / (hz * fine)
    for k in range(len(reference)):
        seen = np.round(q / counts) * counts
        ahead = (reference[min(k + 1, len(reference) - 1)] - reference[max(k - 1, 0)]) * hz / 2
        force = 1500.0 * (40.0 * (reference[k] - seen) + ahead - v)
        force = min(max(force, -400.0), 400.0) + noise[k]
        out[0, k], out[1, k] = seen, force
        for _ in range(fine):
            drag = (Cp if v > 0 else Cn) * v + quadratic * v * abs(v) + constant + spring * q
            for m in range(len(magnets)):
                drag += magnets[m, 0] * np.cos(2.0 * np.pi * q / magnets[m, 1] + magnets[m, 2])
            free = v + dt / M * (force - drag)
            more = tight[2] if tight[0] < q < tight[1] else 0.0
            stop = dt / M * (F_d + more + stribeck * np.exp(-abs(v) / 0.02))
            before = v
            v = 0.0 if abs(free) <= stop else free - np.sign(free) * stop
            q += 0.5 * dt * (before + v)


def table(bench: Table, seed: int, *, seconds: float = 16.0) -> Record:
    """Reversing trapezoids of several speeds over a travel of about 0.2 m, position and force recorded."""
    rng = np.random.default_rng(seed)
    n = round(seconds * bench.hz)
    t = np.arange(n) / bench.hz
    v = np.zeros(n)
    k, side = 0, 1.0
    for top in np.tile((0.05, 0.12, 0.25, 0.4), 20):
        m = round(bench.hz * (0.2 / top + 0.1))
        ramp = np.minimum(1.0, np.minimum(np.arange(m), np.arange(m)[::-1]) / (0.1 * bench.hz))
        stop = min(k + m, n)
        v[k:stop] = side * top * ramp[: stop - k]
        k, side = stop + round(0.05 * bench.hz), -side
        if k >= n:
            break
    reference = np.cumsum(v) / bench.hz
    out = np.empty((2, n))
    noise = bench.ripple * rng.standard_normal(n)
    _table(
        reference, bench.hz, bench.M, bench.F_d, bench.C_positive, bench.C_negative, bench.constant, bench.quadratic,
        bench.spring, bench.stribeck, bench.counts, noise,
        np.array(bench.magnets).reshape(-1, 3), bench.tight, out,
    )  # fmt: skip
    force = out[1] + bench.ripple * rng.standard_normal(n)
    return Record((Cycle(0, {"t": t, "q": out[0], "force": force, "q_ref": reference}),))


TABLE_LOOP = {"gives": "force", "K_p": 60000.0, "K_d": 1500.0, "limit": 400.0}
SERVO_LOOP = {"gives": "duty", "K_p": 8.0, "limit": 1.0}


def table_plant(bench: Table) -> dict[str, object]:
    """What its maker would write: mass, friction and one viscous coefficient, none of them exact."""
    return {
        "kind": "axis", "motion": "linear", "drive": "force", "M": 1.05 * bench.M, "F_d": 15.0, "C": 190.0,
        "fitted": ["M", "C"],
    }  # fmt: skip


@dataclass(frozen=True)
class Servo:
    """A geared servo with a pendulum at its output; the firmware asks for a duty by the position's error."""

    J: float = 0.012  # [kg m²] rotor through the gear, and pendulum
    gravity: float = 0.9  # [N m] at the horizontal
    F_d: float = 0.06
    C: float = 0.04
    by_load: float = 0.0  # share of what the gear passes on
    constant: float = 0.0
    k_t: float = 1.6
    k_e: float = 1.6
    R: float = 2.4
    supply: float = 12.0
    hz: int = 250
    count: float = 2 * np.pi / 4096


@njit(cache=True)
def _servo(reference, on, hz, J, gravity, F_d, C, by_load, constant, k_t, k_e, R, supply, count, kp, out):
    theta, w, fine = 0.0, 0.0, 100
    dt = 1.0 / (hz * fine)
    for k in range(len(reference)):
        seen = np.round(theta / count) * count
        duty = min(max(kp * (reference[k] - seen), -1.0), 1.0) * on[k]
        out[0, k], out[1, k], out[2, k] = seen, duty, w
        for _ in range(fine):
            motor = k_t / R * (duty * supply - k_e * w) * on[k]
            load = gravity * np.sin(theta)
            passed = abs(load + constant)
            free = w + dt / J * (motor - load - C * w - constant)
            stop = dt / J * (F_d + by_load * passed)
            before = w
            w = 0.0 if abs(free) <= stop else free - np.sign(free) * stop
            theta += 0.5 * dt * (before + w)


def servo(bench: Servo, seed: int, *, seconds: float = 16.0, off: tuple[float, float] | None = None) -> Record:
    """Swings of several amplitudes about several places; position, duty and supply recorded. `off`: no torque then."""
    rng = np.random.default_rng(seed)
    n = round(seconds * bench.hz)
    t = np.arange(n) / bench.hz
    reference = np.zeros(n)
    for a, f in ((0.9, 0.23), (0.5, 0.61), (0.25, 1.3)):
        reference += a * np.sin(2 * np.pi * f * t + rng.uniform(0, 6))
    reference *= np.minimum(1.0, t)
    on = np.ones(n)
    if off:
        on[(t >= off[0]) & (t < off[1])] = 0.0
    out = np.empty((3, n))
    _servo(
        reference, on, bench.hz, bench.J, bench.gravity, bench.F_d, bench.C, bench.by_load, bench.constant, bench.k_t,
        bench.k_e, bench.R, bench.supply, bench.count, 8.0, out,
    )  # fmt: skip
    channels = {"t": t, "theta_m": out[0], "u_q": out[1] * bench.supply, "theta_ref": reference}
    if off:
        channels["enabled"] = on
    return Record((Cycle(0, channels),))


def servo_plant(bench: Servo) -> dict[str, object]:
    """What the data sheet says: motor and gear; nothing of the pendulum."""
    return {
        "kind": "axis", "drive": "voltage", "J": bench.J, "F_d": 0.05, "C": bench.C, "k_t": bench.k_t,
        "k_e": bench.k_e, "R": bench.R, "L": 1e-3, "fitted": ["J"],
    }  # fmt: skip
