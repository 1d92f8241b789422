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
def _mass(q1, q2, p):
    """Mass matrix: of the shoulder, coupling, of the elbow. In scalars: a matrix product takes seconds to compile."""
    m1, m2, l1, r1, r2, I1, I2, rotor, gear = p
    s1, c1, s12, c12 = np.sin(q1), np.cos(q1), np.sin(q1 + q2), np.cos(q1 + q2)
    # columns of the Jacobians: of the first centre by the shoulder, of the second by the shoulder and by the elbow
    ax, ay = r1 * c1, r1 * s1
    bx, by = l1 * c1 + r2 * c12, l1 * s1 + r2 * s12
    cx, cy = r2 * c12, r2 * s12
    shoulder = m1 * (ax * ax + ay * ay) + m2 * (bx * bx + by * by) + I1 + I2
    coupling = m2 * (bx * cx + by * cy) + I2
    elbow = m2 * (cx * cx + cy * cy) + I2
    # rotors by the turns of each joint, (gear, 0) and (1, -gear): the elbow's rotor turns against its joint
    return shoulder + rotor * (gear**2 + 1.0), coupling - rotor * gear, elbow + rotor * gear**2


@njit(cache=True)
def _height(q1, q2, p):
    m1, m2, l1, r1, r2 = p[:5]
    return -9.81 * (m1 * r1 * np.cos(q1) + m2 * (l1 * np.cos(q1) + r2 * np.cos(q1 + q2)))


@njit(cache=True)
def _slopes(q1, q2, d1, d2, p):
    """Of the mass matrix' three numbers and of the height, along the step (d1, d2) = 1e-5 of one joint."""
    a, b, c = _mass(q1 + d1, q2 + d2, p)
    a_0, b_0, c_0 = _mass(q1 - d1, q2 - d2, p)
    up, down = _height(q1 + d1, q2 + d2, p), _height(q1 - d1, q2 - d2, p)
    e = 2.0 * (d1 + d2)
    return (a - a_0) / e, (b - b_0) / e, (c - c_0) / e, (up - down) / e


@njit(cache=True)
def _run(reference, fine, dt, p, dry, viscous, on_sum, noise, out):
    q1, q2, v1, v2 = reference[0, 0], reference[0, 1], 0.0, 0.0
    for k in range(len(reference) - 1):
        ahead1, ahead2 = (reference[k + 1] - reference[k]) / (dt * fine)
        asked1 = 60.0 * (reference[k, 0] - q1) + 4.0 * (ahead1 - v1) + noise[k, 0]
        asked2 = 25.0 * (reference[k, 1] - q2) + 1.0 * (ahead2 - v2) + noise[k, 1]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = q1, q2, asked1, asked2
        for _ in range(fine):
            M11, M12, M22 = _mass(q1, q2, p)
            a1, b1, c1, gravity1 = _slopes(q1, q2, 1e-5, 0.0, p)
            a2, b2, c2, gravity2 = _slopes(q1, q2, 0.0, 1e-5, p)
            a, b, c = a1 * v1 + a2 * v2, b1 * v1 + b2 * v2, c1 * v1 + c2 * v2  # dM/dt
            pull1 = 0.5 * (a1 * v1 * v1 + 2.0 * b1 * v1 * v2 + c1 * v2 * v2)
            pull2 = 0.5 * (a2 * v1 * v1 + 2.0 * b2 * v1 * v2 + c2 * v2 * v2)
            of_both = on_sum * np.tanh((v1 + v2) / 2e-3)
            f1 = asked1 - dry[0] * np.tanh(v1 / 2e-3) - viscous[0] * v1 - of_both - a * v1 - b * v2 + pull1 - gravity1
            f2 = asked2 - dry[1] * np.tanh(v2 / 2e-3) - viscous[1] * v2 - of_both - b * v1 - c * v2 + pull2 - gravity2
            det = M11 * M22 - M12 * M12
            v1, v2 = v1 + dt * (M22 * f1 - M12 * f2) / det, v2 + dt * (M11 * f2 - M12 * f1) / det
            q1, q2 = q1 + dt * v1, q2 + dt * v2


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
