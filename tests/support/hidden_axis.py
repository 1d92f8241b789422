"""What is hidden in the bench's records: each function draws a size in the realistic range and hides one effect.

Functional forms differ from the library's wherever physics allows, so that finding an effect is no tautology.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from axis_bench import MOTIONS, PLANT, Bench

TORQUE = 0.05  # [N m] rms of the bench's drive torque, about
F = 0.02  # [N m] friction


def _signed(rng, low, high):
    return rng.choice([-1.0, 1.0]) * rng.uniform(low, high)


def viscous_drag(bench, rng):
    """Grease: torque of power 0.95 of speed, not 1."""
    c = rng.uniform(1e-4, 4e-4)
    bench.torque = lambda th, w, i, t: c * np.sign(w) * np.abs(w) ** 0.95
    return {"coefficient": c * 0.85}


def quadratic_drag(bench, rng):
    """Fan with a small cubic part."""
    c = rng.uniform(3e-6, 1.2e-5)
    bench.torque = lambda th, w, i, t: c * w * np.abs(w) * (1.0 + 1e-3 * np.abs(w))
    return {"coefficient": c}


def cogging(bench, rng):
    """Two lines, the second at twice the order (LCM 12 or 36 and its double)."""
    n = float(rng.choice([6, 12, 18, 24, 36]))
    a, phase = rng.uniform(0.004, 0.015), rng.uniform(0, 2 * np.pi, 2)
    bench.torque = lambda th, w, i, t: a * np.sin(n * th + phase[0]) + 0.15 * a * np.sin(2 * n * th + phase[1])
    return {"amplitude": a, "order": n}


def stribeck(bench, rng):
    """Lorentzian fall instead of an exponential."""
    e, ws = rng.uniform(0.2, 0.6), rng.uniform(3.0, 10.0)
    bench.friction = lambda th, w, i, t, d: 1.0 + e / (1.0 + (w / ws) ** 2)
    return {"excess": e}


def asymmetric_friction(bench, rng):
    a = _signed(rng, 0.1, 0.4)
    bench.friction = lambda th, w, i, t, d: np.where(d > 0, 1.0 + a, 1.0 - a)
    return {"asymmetry": a}


def load_friction(bench, rng):
    """Grows with the square root of a sum of squares, nearly |τ|."""
    c = rng.uniform(5.0, 12.0)
    bench.friction = lambda th, w, i, t, d: 1.0 + c * (np.hypot(0.05 * i, 0.002) - 0.002)
    return {"per_torque": c}


def constant_load(bench, rng):
    tau = _signed(rng, 0.002, 0.008)
    bench.torque = lambda th, w, i, t: tau
    return {"torque": tau}


def spring_load(bench, rng):
    """A stiffening spring."""
    k = rng.uniform(3e-4, 1.5e-3)
    bench.torque = lambda th, w, i, t: k * th * (1.0 + 2e-4 * th**2)
    return {"stiffness": k}


def magnet_flux(bench, rng):
    d = rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.1)
    bench.k_t *= 1.0 + d
    bench.k_e *= 1.0 + d
    return {"change": d}


def winding_resistance(bench, rng):
    d = rng.uniform(0.08, 0.4)
    bench.R *= 1.0 + d
    return {"change": d}


def inverter_drop(bench, rng):
    """Smooth sign."""
    v = rng.uniform(0.05, 0.3)
    before = bench.voltage
    bench.voltage = lambda u, i: before(u, i) + v * np.tanh(i / 0.02)
    return {"voltage": v}


def saturation(bench, rng):
    """Torque per current and voltage per speed (power balance) fall by a smooth knee, not by 1/(1 + β i²)."""
    beta = rng.uniform(0.02, 0.06)
    bench.torque_factor = bench.emf_factor = lambda i: 1.0 - beta * np.abs(i) ** 2 / np.sqrt(1.0 + (0.25 * i) ** 2)
    return {"emf": beta}


def resolver_error(bench, rng):
    a, b = rng.uniform(0.005, 0.03, 2)
    p, q = rng.uniform(0, 2 * np.pi, 2)
    bench.measured_theta = lambda th, w, t: th + a * np.sin(th + p) + b * np.sin(2 * th + q)
    bench.measured_w = lambda th, w, t: w * (1.0 + a * np.cos(th + p) + 2 * b * np.cos(2 * th + q))
    return {"once_cosine": a * np.sin(p)}


def speed_delay(bench, rng):
    bench.w_late = round(rng.uniform(5e-4, 4e-3), 4)
    return {"time": bench.w_late}


def position_delay(bench, rng):
    bench.theta_late = round(rng.uniform(5e-4, 4e-3), 4)
    return {"time": bench.theta_late}


def clock_skew(bench, rng):
    bench.clock = 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.003, 0.01)
    return {"rate": 1.0 / bench.clock - 1.0}


def inertia(bench, rng):
    d = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.3)
    bench.J, bench.J_load = (1.0 + d) * bench.J, (1.0 + d) * bench.J_load  # of all of it, whatever shaft it is behind
    return {"change": d}


def drive_gain(bench, rng):
    g = rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.1)
    before = bench.measured_i
    bench.measured_i = lambda i: before(i) + g * i  # of the true current, whatever offset is there
    return {"gain": g}


def drive_offset(bench, rng):
    d = _signed(rng, 0.03, 0.1)
    before = bench.measured_i
    bench.measured_i = lambda i: before(i) + d
    return {"offset": d}


def position_friction(bench, rng):
    """A stretch with soft edges (two logistic steps), not a Gaussian."""
    h, c, w = rng.uniform(0.4, 1.5), rng.uniform(-1.0, 5.0), rng.uniform(0.5, 1.5)
    bench.friction = lambda th, w_, i, t, d: (
        1.0 + h * (1.0 / (1.0 + np.exp(-(th - c + w) / (0.4 * w))) - 1.0 / (1.0 + np.exp(-(th - c - w) / (0.4 * w))))
    )
    return {"height": h, "centre": c}


def gear_compliance(bench, rng):
    """Part of the inertia behind a shaft that stiffens, with a damper that does not know the resonance."""
    share, f, zeta = rng.uniform(0.3, 0.7), rng.uniform(12.0, 50.0), rng.uniform(0.02, 0.1)
    bench.J, bench.J_load = (1.0 - share) * bench.J, share * bench.J
    k = (2.0 * np.pi * f) ** 2 * bench.J_load
    d = 2.0 * zeta * np.sqrt(k * bench.J_load)
    bench.shaft = lambda twist, rate: k * twist * (1.0 + 5.0 * twist**2) + d * rate
    return {"compliance": 1.0 / k, "inertia": bench.J_load}


def supply_sag(bench, rng):
    """The command is raised for a bus that falls with the current it feeds: u (U / U_bus), U_bus by three rounds."""
    R, U, before = rng.uniform(0.5, 2.0), bench.V_dc, bench.voltage

    def commanded(u, i):
        u = before(u, i)
        bus = U
        for _ in range(3):
            bus = U - R * u * i / bus
        return u * U / bus

    bench.voltage = commanded
    return {"resistance": R}


LIBRARY = {
    f.__name__: f
    for f in (
        viscous_drag,
        quadratic_drag,
        cogging,
        stribeck,
        asymmetric_friction,
        load_friction,
        constant_load,
        spring_load,
        magnet_flux,
        winding_resistance,
        inverter_drop,
        saturation,
        resolver_error,
        speed_delay,
        position_delay,
        clock_skew,
        inertia,
        drive_gain,
        drive_offset,
        position_friction,
        gear_compliance,
        supply_sag,
    )
}


# Outside the library: must come out as "unexplained", with the structure named here.


def odd_line(bench, rng):
    """A torque line at an order that is no whole number (a bearing, a belt)."""
    n = rng.choice([3, 5, 7, 9]) + rng.uniform(0.3, 0.7)
    a, p = rng.uniform(0.005, 0.012), rng.uniform(0, 2 * np.pi)
    bench.torque = lambda th, w, i, t: a * np.sin(n * th + p)
    return {"order": n}


def intermittent_drag(bench, rng):
    """Something rubs for a while in the middle of each cycle."""
    t0, d, extra = rng.uniform(0.5, 0.9), rng.uniform(0.15, 0.3), rng.uniform(0.6, 1.5)
    bench.friction = lambda th, w, i, t, dr: 1.0 + extra * (t0 < t < t0 + d) + 0.0 * th
    return {"time": t0 + 0.5 * d}


def hunting(bench, rng):
    """The supply or a neighbour shakes the bench with a fixed frequency."""
    f, a, p = rng.uniform(4.0, 25.0), rng.uniform(0.004, 0.012), rng.uniform(0, 2 * np.pi)
    bench.torque = lambda th, w, i, t: a * np.sin(2 * np.pi * f * t + p) + 0.0 * th
    return {"frequency": f}


def one_sided_driver(bench, rng):
    """A driver that loses part of the positive current only."""
    g = rng.uniform(0.1, 0.25)
    bench.torque_factor = lambda i: np.where(i > 0, 1.0 - g, 1.0)
    return {"gain": g}


OUTSIDE = {f.__name__: f for f in (odd_line, intermittent_drag, hunting, one_sided_driver)}


def drawn(seed):
    """Another bench for each seed: inertia, friction, noise and motions differ, friction also from its plant file.

    Returns
    -------
    bench : Bench
    plant : dict
        The plant file, which knows all but the friction; every second one does not know the noise either.
    motions : array, shape (n_cycles, 3)
    """
    rng = np.random.default_rng([seed, 77])
    bench = Bench()
    bench.J *= np.exp(rng.uniform(-0.4, 0.4))
    bench.C *= rng.uniform(0.5, 1.5)
    bench.F_d *= rng.uniform(0.7, 1.4)
    bench.F_s = bench.F_d * rng.uniform(1.0, 1.4)
    bench.noise = {name: rms * np.exp(rng.uniform(-0.7, 0.5)) for name, rms in bench.noise.items()}
    motions = np.array(MOTIONS) * [rng.uniform(0.7, 1.4), rng.uniform(0.8, 1.25), rng.uniform(0.7, 1.4)]
    plant = {**PLANT, "J": bench.J, "C": bench.C, "noise": dict(bench.noise)}
    if rng.random() < 0.5:
        del plant["noise"]
    return bench, plant, motions


def bench_with(names, seed, bench=None, but=""):
    """A bench with the named effects hidden in it, and their true parameters; `but` is drawn and not hidden."""
    rng = np.random.default_rng([seed, len(names)])
    bench = Bench() if bench is None else bench
    truth = {}
    everything = {**LIBRARY, **OUTSIDE}
    torques, frictions = [], []
    for name in names:
        before = (bench.torque, bench.friction)
        truth[name] = everything[name](copy(bench) if name == but else bench, rng)
        if bench.torque is not before[0]:
            torques.append(bench.torque)
        if bench.friction is not before[1]:
            frictions.append(bench.friction)
    if len(torques) > 1:
        bench.torque = lambda *a: sum(f(*a) for f in torques)
    if len(frictions) > 1:
        bench.friction = lambda *a: np.prod([f(*a) for f in frictions], axis=0)
    return bench, truth, rng
