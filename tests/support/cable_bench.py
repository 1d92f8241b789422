"""A direct drive under a cascade, with a cable that is drawn along, and what else pulls at it. No code of the library.

J θ'' = τ - cable - spring θ - G sin(θ + φ) - lines - C θ' - F tanh(θ'/v)      by the classical rule of Runge and Kutta

The cable pulls as a hyperbolic sine or, drawn taut on one side only, as a hyperbola that leaves zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

FINE = 10  # steps between samples


@dataclass(frozen=True)
class Bench:
    """SI units. `cable` is its stiffness in the middle, `over` the angle over which it stiffens."""

    J: float = 2e-3
    F: float = 0.05
    C: float = 4e-3
    cable: float = 0.0
    over: float = 0.5
    taut: float = 0.0  # stiffness of a cable beyond the middle, on the upper side only
    spring: float = 0.0
    G: float = 0.0
    phase: float = 0.0
    lines: tuple[tuple[float, float, float], ...] = ()  # amplitude, order, phase
    span: float = 0.9  # [rad] the motion goes so far to both sides of `centre`
    centre: float = 0.0
    noise: tuple[float, float] = (2e-4, 4e-3)  # angle, torque


def load(b: Bench, theta: np.ndarray) -> np.ndarray:
    """The torque of cable, spring and gravity at an angle. [N m]"""
    return np.array([_load(x, _numbers(b), np.array(b.lines).reshape(-1, 3)) for x in theta])


def plant(b: Bench) -> dict[str, object]:
    """What a first guess would say: friction and drag nearly, nothing of what pulls."""
    file = {"kind": "axis", "drive": "torque", "J": 1.1 * b.J, "F_d": 0.8 * b.F, "C": b.C, "fitted": ["J", "C"]}
    return {**file, "noise": {"theta_m": b.noise[0]}}


def _numbers(b: Bench) -> np.ndarray:
    return np.array([b.cable, b.over, b.taut, b.spring, b.G, b.phase, b.centre])


@njit(cache=True)
def _load(theta, p, lines):
    cable, over, taut, spring, G, phase, centre = p
    x = (theta - centre) / over
    torque = cable * over * np.sinh(x) + spring * theta + G * np.sin(theta + phase)
    torque += taut * over * 0.5 * (x + np.sqrt(x * x + 0.1))
    for n in range(lines.shape[0]):
        torque += lines[n, 0] * np.sin(lines[n, 1] * theta + lines[n, 2])
    return torque


@njit(cache=True)
def _acceleration(theta, w, torque, p, lines, J, C, F):
    return (torque - _load(theta, p, lines) - C * w - F * np.tanh(w / 0.01)) / J


@njit(cache=True)
def _run(dt, wanted, ahead, p, lines, J, C, F, out):
    theta, w, summed, h = wanted[0], 0.0, 0.0, dt / FINE
    for k in range(len(wanted)):
        summed += dt * (wanted[k] - theta)
        torque = 8.0 * (wanted[k] - theta) + 0.15 * (ahead[k] - w) + 20.0 * summed
        out[k] = theta, torque
        for _ in range(FINE):
            a1 = _acceleration(theta, w, torque, p, lines, J, C, F)
            a2 = _acceleration(theta + 0.5 * h * w, w + 0.5 * h * a1, torque, p, lines, J, C, F)
            a3 = _acceleration(theta + 0.5 * h * w + 0.25 * h * h * a1, w + 0.5 * h * a2, torque, p, lines, J, C, F)
            a4 = _acceleration(theta + h * w + 0.5 * h * h * a2, w + h * a3, torque, p, lines, J, C, F)
            theta += h * w + h * h / 6.0 * (a1 + a2 + a3)
            w += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


def record(b: Bench, seed: int, *, seconds: float = 12.0, hz: float = 1000.0) -> Record:
    """Three sines of drawn frequencies over the whole travel; angle and torque."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / hz)
    turns = np.outer(np.array([0.23, 0.61, 1.3]) * rng.uniform(0.8, 1.2, 3), 2.0 * np.pi * t)
    wanted = np.array([0.6, 0.3, 0.1]) @ np.sin(turns + rng.uniform(0.0, 2.0 * np.pi, 3)[:, None])
    wanted = b.centre + b.span * (2.0 * (wanted - wanted.min()) / np.ptp(wanted) - 1.0)
    out = np.empty((len(t), 2))
    lines = np.array(b.lines, float).reshape(-1, 3)
    _run(1.0 / hz, wanted, np.gradient(wanted, t), _numbers(b), lines, b.J, b.C, b.F, out)
    theta, torque = (x + sigma * rng.standard_normal(len(t)) for x, sigma in zip(out.T, b.noise, strict=True))
    return Record((Cycle(0, {"t": t, "theta_m": theta, "torque": torque}),))
