"""A servo whose controller is analogue, or samples; fine steps of Euler's. Shares no code with the models.

The speed loop asks for i = K_w (ω_ref - ω) on a command that is held for each sample of the record, or runs straight.
The position loop, whose current is recorded as the drive, is always analogue, its command too. Torque may saturate with
the current cubed, and the current follow what is asked for with a lag.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ema.core.records import Cycle, Record

RATE, FINE = 1000, 50  # [Hz] of the record, and steps of the simulation in a sample
PLANT = {"kind": "axis", "J": 0.0085, "F_d": 0.3, "C": 0.004, "k_t": 1.0, "noise": {"w_m": 0.03, "theta_m": 4e-4}}
SPEED_LOOP = {**PLANT, "drive": "speed-loop", "loop": {"K_w": 0.4}}
CURRENT = {**PLANT, "drive": "current"}


@njit(cache=True)
def _run(command, is_position, samples, straight, J, F, C, i_sat, lag, out):
    theta, w, i, asked, dt = 0.0, 0.0, 0.0, 0.0, 1.0 / (RATE * FINE)
    for k in range(len(command)):
        for s in range(FINE):
            after = command[min(k + 1, len(command) - 1)]
            wanted = command[k] + s / FINE * (after - command[k]) if is_position or straight else command[k]
            if is_position:
                asked = 6.0 * (wanted - theta) - 0.25 * w
            elif s == 0 or not samples:
                asked = 0.4 * (wanted - w)
            i = asked if lag == 0.0 else i + dt / lag * (asked - i)
            if s == 0:
                out[0, k], out[1, k], out[2, k] = theta, w, i
            tau = i / (1.0 + abs(i / i_sat) ** 3) ** (1.0 / 3.0) - C * w
            if w == 0.0:
                tau = 0.0 if abs(tau) <= F else tau - np.sign(tau) * F
            else:
                tau -= np.sign(w) * F
            faster = w + dt / J * tau
            faster = 0.0 if faster * w < 0.0 else faster
            theta += 0.5 * dt * (w + faster)
            w = faster


def record(
    seed: int, *, position: bool = False, samples: bool = False, straight: bool = False,
    inertia: float = 0.0085, i_sat: float = 1e9, lag: float = 0.0, seconds: float = 12.0,
) -> Record:  # fmt: skip
    """A record of several sines at once, to a speed loop or (as `i_q`) from a position loop."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    amplitudes, pace = ((1.5, 0.8, 0.4), (0.4, 1.1, 2.3)) if position else ((6.0, 4.0, 3.0), (0.5, 1.7, 4.1))
    phases = rng.uniform(0.0, 6.0, 3)
    command = sum(a * np.sin(2.0 * np.pi * f * t + phi) for a, f, phi in zip(amplitudes, pace, phases, strict=True))
    out = np.zeros((3, len(t)))
    _run(command, position, samples, straight, inertia, 0.35, 0.004, i_sat, lag, out)
    theta = out[0] + 4e-4 * rng.standard_normal(len(t))
    w = out[1] + 0.03 * rng.standard_normal(len(t))
    drive = {"i_q": out[2]} if position else {"w_ref": command}
    return Record((Cycle(0, {"t": t, **drive, "theta_m": theta, "w_m": w}),))
