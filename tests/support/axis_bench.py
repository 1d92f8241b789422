"""A motor bench of its own for the blind tests of the axis plant: shares no code with the models that are tested.

A rotary axis under proportional speed control, integrated by the midpoint rule over all cycles at once; friction after
Karnopp (a band of speed counts as rest) and not by the four-state rule. What is hidden in it enters by other
functions than the library's where physics allows: see `hidden_axis.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ema.core.records import Cycle, Record

STEP = 1e-4  # [s]
PERIOD = 1e-3  # [s] of sampling and control
REST = 2e-3  # [rad/s] Karnopp's band


def _none(*_):
    return 0.0


def _one(*_):
    return 1.0


@dataclass
class Bench:
    """Numbers of the bench, and the places where something can be hidden. All functions take arrays over cycles."""

    J: float = 5e-5
    C: float = 2e-5
    F_s: float = 0.022
    F_d: float = 0.02
    k_t: float = 0.05
    k_e: float = 0.0333
    R: float = 0.5
    L: float = 3e-4
    K_w: float = 0.02
    noise: dict[str, float] = field(default_factory=lambda: {"theta_m": 2e-4, "w_m": 0.05, "i_q": 5e-3, "u_q": 0.02})
    torque: Callable = _none  # (theta, w, i, t) → opposing torque
    friction: Callable = _one  # (theta, w, i, t, direction) → factor on friction
    torque_factor: Callable = _one  # (i) → factor on k_t
    emf_factor: Callable = _one  # (i) → factor on k_e
    measured_theta: Callable = lambda theta, w, t: theta
    measured_w: Callable = lambda theta, w, t: w
    measured_i: Callable = lambda i: i
    voltage: Callable = lambda u, i: u
    J_load: float = 0.0  # hangs at a shaft that twists
    shaft: Callable = _none  # (twist, rate of twist) → torque
    V_dc: float = 8.0
    theta_late: float = 0.0
    w_late: float = 0.0
    clock: float = 1.0


MOTIONS = (  # speed references: amplitude [rad/s], frequency [Hz], constant part [rad/s]
    (6.0, 0.7, 0.0),
    (25.0, 1.0, 0.0),
    (60.0, 1.7, 0.0),
    (15.0, 3.0, 10.0),
    (40.0, 0.9, -15.0),
    (8.0, 5.0, 3.0),
)


def record(bench: Bench, rng: np.random.Generator, *, duration: float = 1.5, motions=MOTIONS) -> Record:
    """Run the bench through its motions and record it with noise."""
    n_cycles = len(motions)
    amplitude, frequency, constant = np.array(motions).T
    phase = rng.uniform(0.0, 2.0 * np.pi, n_cycles)
    ratio = round(PERIOD / STEP)
    n = round(duration / PERIOD)
    h = STEP
    theta = rng.uniform(0.0, 2.0 * np.pi, n_cycles)
    w = np.zeros(n_cycles)
    load, load_w = theta, w
    i = np.zeros(n_cycles)
    has_load = bench.J_load > 0.0
    kept = {name: np.empty((n, n_cycles)) for name in ("theta", "w", "i", "u")}
    late = round(0.02 / STEP)
    history = {"theta": np.tile(theta, (late, 1)), "w": np.tile(w, (late, 1))}

    def delayed(name: str, delay: float, k: int) -> np.ndarray:
        return history[name][(k - round(delay / STEP)) % late]

    for k in range(n * ratio):
        t = k * h
        history["theta"][k % late], history["w"][k % late] = theta, w
        if k % ratio == 0:
            w_ref = (constant + amplitude * np.sin(2.0 * np.pi * frequency * t + phase)) * min(1.0, t / 0.1)
            i_new = bench.K_w * (w_ref - w) * 8.0
            i_new = np.minimum(np.maximum(i_new, -4.0), 4.0)
            slope = (i_new - i) / PERIOD  # the current follows within one period
            s = k // ratio
            th, om = delayed("theta", bench.theta_late, k), delayed("w", bench.w_late, k)
            kept["theta"][s] = bench.measured_theta(th, om, t)
            kept["w"][s] = bench.measured_w(th, om, t)
            kept["i"][s] = bench.measured_i(i)
            u = bench.R * i + bench.L * slope + bench.k_e * bench.emf_factor(i) * w
            kept["u"][s] = bench.voltage(u, i)
        i_mid = i + 0.5 * h * slope
        twisting = bench.shaft(theta - load, w - load_w) if has_load else 0.0
        a = _acceleration(bench, theta, w, i_mid, t, twisting)
        w_half = w + 0.5 * h * a
        w_half = np.where(w * w_half < 0.0, 0.0, w_half)
        theta_half = theta + 0.5 * h * w
        if has_load:
            load_half, load_w_half = load + 0.5 * h * load_w, load_w + 0.5 * h * (twisting / bench.J_load)
            twisting = bench.shaft(theta_half - load_half, w_half - load_w_half)
            load, load_w = load + h * load_w_half, load_w + h * (twisting / bench.J_load)
        a = _acceleration(bench, theta_half, w_half, i_mid, t + 0.5 * h, twisting)
        w_next = w + h * a
        w_next = np.where(w * w_next < 0.0, 0.0, w_next)
        theta = theta + 0.5 * h * (w + w_next)
        w = w_next
        i = i + h * slope
    t = np.arange(n) * PERIOD * bench.clock
    cycles = []
    for c in range(n_cycles):
        channels = {"t": t}
        for name, channel in (("theta_m", "theta"), ("w_m", "w"), ("i_q", "i"), ("u_q", "u")):
            channels[name] = kept[channel][:, c] + bench.noise[name] * rng.standard_normal(n)
        cycles.append(Cycle(c, channels))
    return Record(tuple(cycles))


def _acceleration(bench: Bench, theta, w, i, t, twisting):
    """Of the motor, whose shaft takes the torque `twisting`."""
    tau = bench.k_t * bench.torque_factor(i) * i - bench.C * w - bench.torque(theta, w, i, t) - twisting
    resting = np.abs(w) < REST
    direction = np.where(resting, np.sign(tau), np.sign(w))
    factor = bench.friction(theta, w, i, t, direction)
    is_held = resting & (np.abs(tau) <= bench.F_s * factor)
    return np.where(is_held, -w / STEP, (tau - bench.F_d * factor * direction) / bench.J)


PLANT = {
    "kind": "axis",
    "name": "blind test bench",
    "J": 5e-5,
    "C": 2e-5,
    "F_d": 0.02,
    "F_s": 0.022,
    "k_t": 0.05,
    "k_e": 0.0333,
    "R": 0.5,
    "L": 3e-4,
    "V_dc": 8.0,
    "drive": "current",
    "noise": {"theta_m": 2e-4, "w_m": 0.05, "i_q": 5e-3, "u_q": 0.02},
}
