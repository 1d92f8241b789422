"""A motor on bristles (LuGre) beside a constant load, under a position loop: its own simulation, in steps of 10 µs.

    dz/dt = ω - σ_0 |ω| z / F,   τ_f = σ_0 z + σ_1 dz/dt + C ω

The bristles give by F/σ_0 before they slide. Shares no code with the models that are tested.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

DT, CONTROL = 1e-5, 50  # [s] step, and steps of a control period
J, C, F_C, K_T = 3e-4, 4e-4, 0.05, 0.06
S_1 = 0.02  # [N m s/rad]
WAY = 0.004  # [rad] that bristles give
ENCODER, CURRENT_NOISE, SPEED_NOISE = 2.0 * np.pi / 65536, 0.01, 0.02
PLANT = {"drive": "current", "k_t": K_T, "J": J, "C": C, "F_d": F_C, "fitted": ["J", "C"]}


@njit(cache=True)
def _run(reference, speed, load, s_0):
    n = len(reference)
    out = np.zeros((3, n))
    theta, w, z, i = reference[0], 0.0, 0.0, 0.0
    for k in range(n):
        if k % CONTROL == 0:
            i = min(max(12.0 * (reference[k] - theta) + 0.35 * (speed[k] - w), -8.0), 8.0)
        out[:, k] = theta, w, i
        dz = w - s_0 * abs(w) / F_C * z
        friction = s_0 * z + S_1 * dz + C * w
        z += DT * dz
        w += DT * (K_T * i - friction - load) / J
        theta += DT * w
    return out


def record(seed: int, *, load: float, way: float = WAY, rate: float = 1000.0, seconds: float = 6.0) -> Record:
    """Current, angle and speed of a motor that follows three sines."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds / DT)) * DT
    parts = [(A, 2.0 * np.pi * f, rng.uniform(0.0, 2.0 * np.pi)) for A, f in ((2.0, 0.31), (1.0, 0.83), (0.5, 1.7))]
    reference = np.sum([A * np.sin(f * t + phase) for A, f, phase in parts], axis=0)
    speed = np.sum([A * f * np.cos(f * t + phase) for A, f, phase in parts], axis=0)
    theta, w, i = _run(reference, speed, load, F_C / way)[:, :: round(1.0 / rate / DT)]
    channels = {
        "t": t[:: round(1.0 / rate / DT)],
        "i_q": i + CURRENT_NOISE * rng.standard_normal(len(i)),
        "theta_m": ENCODER * np.round(theta / ENCODER),
        "w_m": w + SPEED_NOISE * rng.standard_normal(len(w)),
    }
    return Record((Cycle(0, channels),))
