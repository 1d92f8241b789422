"""A geared motor under cascaded loops, with what warms up, bends, meshes and stands beside it.

Shares no code with the models. Fine steps of a semi-implicit Euler rule. Dry friction by its smallest torque that stops
the axis within a step, or, with `bristle`, by LuGre's bristles. The controller acts on the sampled angle and holds the
current it asks for until the next sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

FINE = 50


@dataclass(frozen=True)
class Axis:
    """Numbers of the axis at the motor's shaft, and what may be hidden in it."""

    J: float = 8e-5
    F: float = 0.03
    C: float = 2.5e-4
    k_t: float = 0.05
    bristle: float = 0.0  # [rad] before it slides
    dry_per_kelvin: float = 0.0
    viscous_activation: float = 0.0  # [K] E/R of Arrhenius' law
    dry_rate: float = 0.0  # [1/s]
    viscous_rate: float = 0.0  # [1/s] of C
    flux_per_kelvin: float = 0.0  # [1/K] of the torque constant
    by_square: float = 0.0  # [1/(N m)] friction over motor torque squared
    gravity: float = 0.0  # [N m] of a load that hangs at the shaft, at the horizontal
    by_load: float = 0.0  # friction over that load
    passed_on: float = 0.0  # share of J whose torque the gear passes on, and loses as much of
    by_load_square: float = 0.0  # [1/(N m)] and over its square
    dry_slope: float = 0.0  # [1/rad] of F along the travel
    viscous_slope: float = 0.0  # [1/rad] of C
    spring: tuple[float, float] = (0.0, 0.0)  # [N m/rad], [N m/rad^3]
    unequal: float = 0.0  # share by which the drive gives more one way, and less the other
    saturation: float = 0.0  # [1/A^2] loss of the torque constant by the current's square
    lines: tuple[tuple[float, float, float], ...] = ()  # amplitude [N m], order per motor turn, phase
    lag: float = 0.0  # [s] time constant with which the current follows the one that is asked for and recorded
    reads: float = 1.0  # recorded current over the true one
    warms: tuple[float, float, float] = (20.0, 20.0, 4.0)  # [°C] from, to, [s] with this time constant
    hz: int = 1000
    noise: tuple[float, float, float] = (2e-4, 0.05, 4e-3)  # position, speed, current


@njit(cache=True)
def _run(reference, hz, p, of_load, along, warm, lines, loop, out):
    J, F, C, k_t, bristle, dry_k, activation, dry_rate, viscous_rate, by_square, flux, unequal, saturation, lag = p
    gravity, by_load, by_load_square, passed_on = of_load
    dry_slope, viscous_slope, stiffness, hardens = along
    K_p, K_w = loop
    theta, w, z, acts, before = reference[0], 0.0, 0.0, 0.0, 0.0
    dt = 1.0 / (hz * FINE)
    for k in range(len(reference)):
        ahead = (reference[min(k + 1, len(reference) - 1)] - reference[max(k - 1, 0)]) * hz / 2
        i = K_w * (K_p * (reference[k] - theta) + ahead - w)
        out[0, k], out[1, k], out[2, k] = theta, w, i
        t = k / hz
        kelvin = warm[k] + 273.15
        drag = C * (1.0 + viscous_rate * t) * np.exp(activation * (1.0 / kelvin - 1.0 / 293.15))
        dry = F * (1.0 + dry_rate * t) * np.exp(-dry_k * (warm[k] - 20.0))
        for _ in range(FINE):
            acts = acts + dt / lag * (i - acts) if lag > 0.0 else i
            motor = k_t * (1.0 + flux * (warm[k] - 20.0) + unequal * np.sign(i)) * acts / (1.0 + saturation * i * i)
            load = gravity * np.sin(theta)
            other = drag * (1.0 + viscous_slope * theta) * w + load + stiffness * theta + hardens * theta**3
            for n in range(lines.shape[0]):
                other += lines[n, 0] * np.sin(lines[n, 1] * theta + lines[n, 2])
            rubs = dry * (1.0 + dry_slope * theta) + by_square * motor * motor
            rubs += by_load * abs(load + passed_on * J * (w - before) / dt) + by_load_square * load * load
            before = w
            if bristle > 0.0:
                stiff = rubs / bristle
                dz = w - abs(w) * z / bristle
                z += dt * dz
                fade = np.exp(-((w / 0.5) ** 2))
                w += dt / J * (motor - other - stiff * z - 0.2 * np.sqrt(stiff * J) * dz * fade)
            else:
                free = w + dt / J * (motor - other)
                stop = dt / J * rubs
                w = 0.0 if abs(free) <= stop else free - np.sign(free) * stop
            theta += dt * w


def record(
    axis: Axis, seed: int, *, seconds: float = 12.0, size: float = 1.0, temperature: bool = False, loop=(40.0, 0.05)
) -> Record:
    """Three sines and a slow sweep back and forth over some turns of the motor."""
    rng = np.random.default_rng(seed)
    n = round(seconds * axis.hz)
    t = np.arange(n) / axis.hz
    reference = np.zeros(n)
    for a, f in ((8.0, 0.21), (2.0, 0.9), (0.4, 2.7)):
        reference += size * a * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0))
    reference *= np.minimum(1.0, t / 0.3)
    low, high, over = axis.warms
    warm = low + (high - low) * (1.0 - np.exp(-t / over))
    out = np.empty((3, n))
    p = (
        *(axis.J, axis.F, axis.C, axis.k_t, axis.bristle, axis.dry_per_kelvin, axis.viscous_activation),
        *(axis.dry_rate, axis.viscous_rate, axis.by_square, axis.flux_per_kelvin, axis.unequal),
        *(axis.saturation, axis.lag),
    )
    of_load = (axis.gravity, axis.by_load, axis.by_load_square, axis.passed_on)
    along = (axis.dry_slope, axis.viscous_slope, *axis.spring)
    _run(reference, axis.hz, p, of_load, along, warm, np.array(axis.lines, float).reshape(-1, 3), loop, out)
    theta, w, i = (x + s * rng.standard_normal(n) for x, s in zip(out, axis.noise, strict=True))
    channels = {"t": t, "theta_m": theta, "w_m": w, "i_q": axis.reads * i}
    if temperature:
        channels["temp_w"] = warm + 0.2 * rng.standard_normal(n)
    return Record((Cycle(0, channels),))


def plant(axis: Axis, **more: object) -> dict[str, object]:
    """What its maker would write: nearly right friction and drag."""
    return {
        "kind": "axis", "drive": "current", "J": axis.J, "F_d": 0.9 * axis.F, "C": 0.9 * axis.C, "k_t": axis.k_t,
        "fitted": ["J", "C"], **more,
    }  # fmt: skip


def held(axis: Axis) -> AxisPlant:
    """Eight seconds of it as the finder has them, the drive held between samples."""
    found = AxisPlant(RotaryAxis.model_validate(plant(axis)), [record(axis, 1, seconds=8.0)], n_threads=1)
    found.between = "held"
    return found
