"""A short, noisy record of a pendulum on a quasi-direct drive, swung up by a PD loop. No code of the library.

J θ'' = τ - G sin θ - C θ' - F tanh(θ'/v)      by the classical rule of Runge and Kutta

The drive's torque is told by its current, which carries noise and single samples of many newton metres. With G = 0 the
axis stands upright, and the same loop moves the bare inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

FINE = 12  # steps between samples


@dataclass(frozen=True)
class Pendulum:
    """SI units; `G`: gravity's torque at 90°."""

    J: float = 0.14
    G: float = 2.9
    C: float = 0.02
    F: float = 0.25
    noise: float = 1.3  # of the torque, every sample
    spike: float = 10.0  # of single samples
    spikes: float = 0.03  # share of samples that have one
    speed_noise: float = 0.4


def plant(build: Pendulum) -> dict[str, object]:
    """What a first guess would say: half the inertia, and no pendulum."""
    return {"kind": "axis", "drive": "torque", "J": 0.5 * build.J, "F_d": build.F, "C": 0.0, "fitted": ["J", "C"]}


@njit(cache=True)
def _acceleration(theta, w, torque, J, G, C, F):
    return (torque - G * np.sin(theta) - C * w - F * np.tanh(w / 0.02)) / J


@njit(cache=True)
def _swung(dt, wanted, ahead, noise, J, G, C, F, out):
    theta, w, h = 0.0, 0.0, dt / FINE
    for k in range(len(wanted)):
        seen = w + noise[k]
        torque = 40.0 * (wanted[k] - theta) + 2.0 * (ahead[k] - seen)
        out[k] = theta, seen, torque
        for _ in range(FINE):
            a1 = _acceleration(theta, w, torque, J, G, C, F)
            a2 = _acceleration(theta + 0.5 * h * w, w + 0.5 * h * a1, torque, J, G, C, F)
            a3 = _acceleration(theta + 0.5 * h * w + 0.25 * h * h * a1, w + 0.5 * h * a2, torque, J, G, C, F)
            a4 = _acceleration(theta + h * w + 0.5 * h * h * a2, w + h * a3, torque, J, G, C, F)
            theta += h * w + h * h / 6.0 * (a1 + a2 + a3)
            w += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


def record(build: Pendulum, seed: int, *, seconds: float = 3.9, hz: float = 300.0) -> Record:
    """One swing-up: the amplitude grows, and it ends near the top."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / hz)
    end, cycles = rng.uniform(2.6, 3.3), rng.uniform(2.6, 2.9)
    wanted = end * (t / seconds) ** 1.5 * np.sin(2.0 * np.pi * cycles * t / seconds) / np.sin(2.0 * np.pi * cycles)
    out = np.empty((len(t), 3))
    noise = build.speed_noise * rng.standard_normal(len(t))
    _swung(1.0 / hz, wanted, np.gradient(wanted, t), noise, build.J, build.G, build.C, build.F, out)
    torque = out[:, 2] + build.noise * rng.standard_normal(len(t))
    torque += build.spike * rng.standard_normal(len(t)) * (rng.random(len(t)) < build.spikes)
    angle = np.round((out[:, 0] + 1e-3 * rng.standard_normal(len(t))) / 2.9e-3) * 2.9e-3
    return Record((Cycle(0, {"t": t, "theta_m": angle, "w_m": out[:, 1], "torque": torque}),))
