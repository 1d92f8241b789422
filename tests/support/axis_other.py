"""Further axes for the blind tests: other motors, masses, drives, sampling and sensors than `axis_bench`'s.

State (position, speed, bristle, current) by Runge and Kutta's method of fourth order; friction after Canudas de Wit et
al. (LuGre), whose bristles give way a little before they slide. Encoders count, currents carry ripple, speeds are
differences of counts where nobody measures them. Shares no code with the models that are tested, nor with `axis_bench`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

QUIET = dict.fromkeys(("position", "speed", "drive", "u", "i"), 0.0)


@dataclass(frozen=True)
class Setup:
    """One axis, how it is driven and how it is recorded. Units are SI; a linear axis reads m, kg, N."""

    motion: str = "rotary"
    drive: str = "current"  # or voltage, force
    inertia: float = 5e-5
    F_d: float = 0.02
    F_s: float = 0.022
    C: float = 2e-5
    k_t: float = 0.05
    k_e: float = 0.0333
    R: float = 0.5
    L: float = 3e-4
    w_stribeck: float = 0.05  # [rad/s] over which F_s falls to F_d
    bristle: float = 2e-4  # [rad] a bristle gives way before it slides
    period: float = 1e-3
    duration: float = 1.5
    gains: tuple[float, float] = (0.0, 0.16)  # of position and speed, to the drive
    motions: tuple[tuple[float, float, float], ...] = (
        (6, 0.7, 0),
        (25, 1, 0),
        (60, 1.7, 0),
        (15, 3, 10),
        (40, 0.9, -15),
    )
    counts: float = 0.0  # step of the encoder [rad], 0: noise instead
    noise: dict[str, float] = field(
        default_factory=lambda: {"position": 2e-4, "speed": 0.05, "drive": 5e-3, "u": 0.02, "i": 5e-3}
    )
    speed: str = "measured"  # or none, or difference (of counts, through a filter)
    held: bool = False  # the drive jumps at each sample and is held until the next, instead of running straight
    ripple: float = 0.0  # of the sampled current, relative to its size, at a frequency beside that of sampling
    hidden: tuple[float, ...] = (0.0,) * 8  # see `_hidden`
    channels: tuple[str, ...] = ()  # optional ones to keep; all if empty


@njit(cache=True)
def _bristle(z, v, h, p, hid):
    """Deflection after a time h at speed v, exactly."""
    side = 1.0 + hid[5] * (1.0 if v > 0.0 else -1.0)
    g = (p[1] + (p[2] - p[1]) * np.exp(-((v / p[8]) ** 2))) * side
    rate = p[1] / p[9] * abs(v) / g
    if rate * h < 1e-12:
        return z + v * h
    settled = v / rate
    return settled + (z - settled) * np.exp(-rate * h)


VISCOUS, CONSTANT, COGGING, ORDER, SPRING, ASYMMETRY, QUADRATIC, EVEN = range(8)


@njit(cache=True)
def _rates(x, v, z, i, u, mode, p, hid, out):
    inertia, F_d, F_s, C, k_t, k_e, R, L, w_s, bristle = p
    force = k_t * i if mode != 2 else u
    if hid[7] != 0.0:
        force += hid[7] * abs(force)
    side = 1.0 + hid[5] * (1.0 if v > 0.0 else -1.0)
    g = (F_d + (F_s - F_d) * np.exp(-((v / w_s) ** 2))) * side
    s0 = F_d / bristle
    dz = v - s0 * abs(v) / g * z
    s1 = 0.3 * np.sqrt(s0 * inertia)
    friction = s0 * z + s1 * dz * np.exp(-((v / w_s) ** 2))
    other = (C + hid[0]) * v + hid[1] + hid[2] * np.sin(hid[3] * x + 0.7) + hid[4] * x + hid[6] * v * abs(v)
    out[0] = v
    out[1] = (force - friction - other) / inertia
    out[2] = 0.0
    out[3] = (u - R * i - k_e * v) / L if mode == 1 else 0.0


@njit(cache=True)
def _run(n, ratio, h, mode, p, hid, amplitude, frequency, constant, phase, K, limit, held, x0, out):
    s = np.array([x0, 0.0, 0.0, 0.0])
    k1, k2, k3, k4 = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    u, slope, x_ref = 0.0, 0.0, x0
    for k in range(n * ratio):
        t = k * h
        if k % ratio == 0:
            w_ref = (constant + amplitude * np.sin(2 * np.pi * frequency * t + phase)) * min(1.0, t / 0.1)
            x_ref += w_ref * h * ratio
            new = min(max(K[0] * (x_ref - s[0]) + K[1] * (w_ref - s[1]), -limit), limit)
            if mode == 1:
                new += p[5] * w_ref
            if held:
                u = new
            slope = (new - u) / (h * ratio)
            out[0, k // ratio], out[1, k // ratio], out[2, k // ratio], out[3, k // ratio] = s[0], s[1], u, s[3]
        if mode == 0:
            s[3] = u
        s[2] = _bristle(s[2], s[1], 0.5 * h, p, hid)
        for stage in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[stage]
            b = s + part * h * (k3 if stage == 3 else (k2 if stage == 2 else k1))
            b[2] = s[2]
            if mode == 0:
                b[3] = u + part * h * slope
            _rates(b[0], b[1], b[2], b[3], u + part * h * slope, mode, p, hid, (k1, k2, k3, k4)[stage])
        z = _bristle(s[2], s[1], 0.5 * h, p, hid)
        s = s + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
        s[2] = z
        u = u + h * slope


def record(setup: Setup, seed: int) -> Record:
    """Run and record."""
    rng = np.random.default_rng(seed)
    n = round(setup.duration / setup.period)
    h = min(2e-5, setup.period / 4)
    ratio = round(setup.period / h)
    h = setup.period / ratio
    mode = {"current": 0, "voltage": 1, "force": 2}[setup.drive]
    p = tuple(
        getattr(setup, k) for k in ("inertia", "F_d", "F_s", "C", "k_t", "k_e", "R", "L", "w_stribeck", "bristle")
    )
    hidden = np.array(setup.hidden, float)
    names = {"rotary": ("theta_m", "w_m"), "linear": ("q", "v")}[setup.motion]
    drive = {"current": "i_q", "voltage": "u_q", "force": "force"}[setup.drive]
    cycles = []
    for number, (amplitude, frequency, constant) in enumerate(setup.motions):
        out = np.empty((4, n))
        start = rng.uniform(0, 2 * np.pi) if setup.motion == "rotary" else 0.0
        motion = (amplitude, frequency, constant, rng.uniform(0, 2.0 * np.pi))
        _run(n, ratio, h, mode, p, hidden, *motion, np.array(setup.gains), 1e9, setup.held, start, out)
        x, w, u, i = out
        t = np.arange(n) * setup.period
        noise = {name: rms * rng.standard_normal(n) for name, rms in {**QUIET, **setup.noise}.items()}
        x_meas = x + noise["position"]
        if setup.counts:
            x_meas = np.round(x_meas / setup.counts) * setup.counts
        ch = {"t": t, names[0]: x_meas}
        if setup.speed == "measured":
            ch[names[1]] = w + noise["speed"]
        elif setup.speed == "difference":
            raw = np.diff(x_meas, prepend=x_meas[0]) / setup.period
            y, state = np.empty(n), raw[0]
            for k in range(n):
                state += 0.4 * (raw[k] - state)
                y[k] = state
            ch[names[1]] = y
        ch[drive] = u + noise["drive"] + setup.ripple * np.ptp(u) * np.sin(2 * np.pi * 0.317 / setup.period * t)
        if setup.drive == "voltage":
            ch["i_q"] = i + noise["i"]
        if setup.drive == "current":
            di = np.gradient(u, setup.period)
            ch["u_q"] = setup.R * u + setup.L * di + setup.k_e * w + noise["u"]
        if setup.channels:
            ch = {k: c for k, c in ch.items() if k in setup.channels or k in ("t", drive)}
        cycles.append(Cycle(number, ch))
    return Record(tuple(cycles))


def plant(setup: Setup) -> dict[str, object]:
    """What its maker would write into the plant file."""
    d = {"kind": "axis", "motion": setup.motion, "drive": setup.drive, "F_d": setup.F_d, "F_s": setup.F_s, "C": setup.C}
    d["J" if setup.motion == "rotary" else "M"] = setup.inertia
    if setup.drive != "force":
        d |= {"k_t": setup.k_t, "k_e": setup.k_e, "R": setup.R, "L": setup.L}
    return d


BASE = Setup()
SETUPS = {
    "fast": replace(BASE, period=1e-4, duration=0.8),
    "slow": replace(BASE, period=5e-3, duration=6.0),
    "encoder": replace(BASE, counts=2 * np.pi / 20000, speed="none", noise={"drive": 5e-3, "u": 0.02}),
    "coarse": replace(BASE, counts=2 * np.pi / 4096, speed="difference", noise={"drive": 5e-3, "u": 0.02}),
    "ripple": replace(BASE, ripple=0.02),
    "clean": replace(BASE, noise={}),
    "voltage": replace(
        BASE,
        drive="voltage",
        gains=(0.0, 0.08),
        noise={"position": 2e-4, "speed": 0.05, "drive": 2e-3, "i": 5e-3},
    ),
    "stage": replace(
        BASE,
        motion="linear",
        drive="force",
        inertia=12.0,
        F_d=8.0,
        F_s=9.0,
        C=15.0,
        w_stribeck=1e-3,
        bristle=2e-6,
        gains=(400.0, 300.0),
        period=2e-3,
        duration=3.0,
        motions=((0.05, 0.5, 0), (0.2, 1, 0), (0.4, 1.7, 0), (0.1, 3, 0.05)),
        counts=1e-6,
        noise={"drive": 0.2},
        speed="none",
    ),
    "spindle": replace(
        BASE,
        inertia=0.02,
        F_d=0.4,
        F_s=0.5,
        C=0.002,
        k_t=0.9,
        k_e=0.6,
        R=1.2,
        L=5e-3,
        gains=(0.0, 3.0),
        period=5e-4,
        duration=2.0,
        motions=((20, 0.5, 60), (50, 1.1, 0), (100, 0.4, 0), (30, 4, 0)),
        noise={"position": 1e-3, "speed": 0.1, "drive": 0.02, "u": 0.3},
    ),
}
