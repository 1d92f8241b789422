"""Two links in a plane with a motor at each joint, by Jacobians of the centres of mass and differences of energies.

Shares no code with the library. The joints follow references by a proportional and differential loop; each motor sits
on the link before its joint, turns g times as fast, and its rotor moves with that link.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record


@dataclass(frozen=True)
class Arm:
    """Masses, lengths, distances of centres of mass, inertias about these; rotor and gear; friction of each joint."""

    m: tuple[float, float] = (0.6, 0.55)
    l_1: float = 0.3
    r: tuple[float, float] = (0.25, 0.2)
    inertia: tuple[float, float] = (0.01, 0.006)
    rotor: float = 8e-5
    gear: float = 6.0
    dry: tuple[float, float] = (0.1, 0.08)
    viscous: tuple[float, float] = (0.01, 0.01)
    on_sum: float = 0.0  # [N m] dry friction at both joints on the sum of their speeds


@njit(cache=True)
def _mass(q, p):
    m1, m2, l1, r1, r2, I1, I2, rotor, gear = p
    M = np.zeros((2, 2))
    s1, c1, s12, c12 = np.sin(q[0]), np.cos(q[0]), np.sin(q[0] + q[1]), np.cos(q[0] + q[1])
    J1 = np.array([[r1 * c1, 0.0], [r1 * s1, 0.0]])
    J2 = np.array([[l1 * c1 + r2 * c12, r2 * c12], [l1 * s1 + r2 * s12, r2 * s12]])
    M += m1 * J1.T @ J1 + m2 * J2.T @ J2
    M[0, 0] += I1
    M += I2 * np.ones((2, 2))
    for turns in (np.array([gear, 0.0]), np.array([1.0, -gear])):  # the elbow's rotor turns against its joint
        M += rotor * np.outer(turns, turns)
    return M


@njit(cache=True)
def _height(q, p):
    m1, m2, l1, r1, r2 = p[:5]
    return -9.81 * (m1 * r1 * np.cos(q[0]) + m2 * (l1 * np.cos(q[0]) + r2 * np.cos(q[0] + q[1])))


@njit(cache=True)
def _run(reference, fine, dt, p, dry, viscous, on_sum, noise, out):
    q, v, e = reference[0].copy(), np.zeros(2), 1e-5
    slope = np.zeros((2, 2, 2))
    for k in range(len(reference) - 1):
        ahead = (reference[k + 1] - reference[k]) / (dt * fine)
        asked = np.array([60.0, 25.0]) * (reference[k] - q) + np.array([4.0, 1.0]) * (ahead - v) + noise[k]
        out[k, :2], out[k, 2:] = q, asked
        for _ in range(fine):
            M, gravity = _mass(q, p), np.zeros(2)
            for j in range(2):
                step = np.zeros(2)
                step[j] = e
                slope[j] = (_mass(q + step, p) - _mass(q - step, p)) / (2.0 * e)
                gravity[j] = (_height(q + step, p) - _height(q - step, p)) / (2.0 * e)
            rates = slope[0] * v[0] + slope[1] * v[1]
            pull = np.array([0.5 * v @ slope[0] @ v, 0.5 * v @ slope[1] @ v])
            friction = dry * np.tanh(v / 2e-3) + viscous * v + on_sum * np.tanh((v[0] + v[1]) / 2e-3)
            v = v + dt * np.linalg.solve(M, asked - friction - rates @ v + pull - gravity)
            q = q + dt * v


def records(arm: Arm, seed: int, *, seconds: float = 8.0, hz: int = 500) -> tuple[Record, Record]:
    """Of the shoulder (whose neighbour is the outer axis) and of the elbow (the inner one)."""
    rng = np.random.default_rng(seed)
    n = round(seconds * hz)
    t = np.arange(n) / hz
    reference = np.zeros((n, 2))
    for size, f in (((0.9, 1.2), 0.37), ((0.5, 0.6), 0.83), ((0.2, 0.4), 1.7)):
        for j in range(2):
            reference[:, j] += size[j] * np.sin(2 * np.pi * f * (1.0 + 0.3 * j) * t + rng.uniform(0, 6))
    reference *= np.minimum(1.0, t)[:, None]
    p = np.array([*arm.m, arm.l_1, *arm.r, *arm.inertia, arm.rotor, arm.gear])
    fine, out = 20, np.zeros((n, 4))
    noise = 0.01 * rng.standard_normal((n, 2))
    friction = np.array(arm.dry), np.array(arm.viscous), arm.on_sum
    _run(reference, fine, 1.0 / (hz * fine), p, *friction, noise, out)
    out = out[: n - 1]
    angle = np.round(out[:, :2] / 2e-4) * 2e-4
    torque = out[:, 2:] + 0.01 * rng.standard_normal((n - 1, 2))
    held = 0.5 * (torque + np.roll(torque, 1, axis=0))  # a measurement, between what was asked before and after

    def of(own: int) -> Record:
        channels = {
            "t": t[1 : n - 1],
            "theta_m": angle[1:, own],
            "torque": held[1:, own],
            "theta_n": angle[1:, 1 - own],
        }
        return Record((Cycle(0, channels),))

    return of(0), of(1)


def truth(arm: Arm) -> dict[str, float]:
    """Coefficients of the two balances."""
    (m1, m2), (r1, r2), (i1, i2), l1 = arm.m, arm.r, arm.inertia, arm.l_1
    elbow = i2 + m2 * r2**2
    return {
        "shoulder": i1 + m1 * r1**2 + m2 * l1**2 + elbow + (arm.gear**2 + 1.0) * arm.rotor,
        "elbow": elbow + arm.gear**2 * arm.rotor,
        "coupling": m2 * l1 * r2,
        "inertia": elbow - arm.gear * arm.rotor,
        "gravity": 9.81 * (m1 * r1 + m2 * l1),
        "gravity_outer": 9.81 * m2 * r2,
    }


def plant(side: str) -> dict[str, object]:
    """What is known beforehand: little. `side`: of the neighbour."""
    return {
        "kind": "axis",
        "drive": "torque",
        "J": 0.05,
        "F_d": 0.05,
        "C": 0.005,
        "neighbour": side,
        "fitted": ["J", "C"],
    }
