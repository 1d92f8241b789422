"""A belt under a speed loop: motor and pulley with a spring between, dry friction at both ends. Imports no model."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.signal import lfilter

from ema.core.records import Cycle, Record

J_M, J_L, FREQUENCY, DAMPING = 4.2e-5, 6.5e-5, 23.0, 0.04  # resonance of both ends free
STIFFNESS = (2.0 * np.pi * FREQUENCY) ** 2 * J_M * J_L / (J_M + J_L)
F_M, F_L, C, K_T = 0.011, 0.016, 4e-5, 0.06
RATE, STEPS = 1000, 40
MOVES = ((0.3, 1.3, 20.0), (1.5, 2.2, -35.0), (2.4, 3.6, 60.0), (3.8, 4.5, -12.0), (4.7, 6.0, -60.0))  # s, s, rad/s
NOISE = {"i_q": 6e-3, "theta_m": 2e-4, "w_m": 0.04}


@njit(cache=True)
def _run(reference, stiffness, damping, behind, out):
    theta, w, theta_l, w_l, asked = 0.0, 0.0, 0.0, 0.0, 0.0
    h = 1.0 / (RATE * STEPS)
    for k in range(len(reference)):
        e = reference[k] - w
        i = min(max(0.03 * e + 0.35 * asked, -6.0), 6.0)
        asked += e / RATE
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = theta, w, i, theta_l, w_l
        for _ in range(STEPS):
            T = stiffness * (theta - theta_l) + damping * (w - w_l)
            rubs = (F_M + F_L - behind) * np.tanh(w / 0.05)
            w += h / J_M * (K_T * i - T - C * w - rubs)
            w_l += h / J_L * (T - behind * np.tanh(w_l / 0.05))
            theta += h * w
            theta_l += h * w_l


def record(
    behind: float = F_L, seconds: float = 6.0, *, at_load: bool = False, frequency: float = FREQUENCY, seed: int = 11
) -> Record:
    """Moves with rests between them; `behind` is the dry friction at the pulley, the rest is at the motor. [N m]

    `at_load`: recorded are angle and speed of the pulley; `frequency`: of the resonance. [Hz]
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    reference = np.zeros(len(t))
    for begin, end, speed in MOVES:
        reference[(t >= begin) & (t < end)] = speed
    out = np.empty((5, len(t)))
    stiffness = STIFFNESS * (frequency / FREQUENCY) ** 2
    damping = 2.0 * DAMPING * np.sqrt(stiffness * J_M * J_L / (J_M + J_L))
    _run(lfilter([0.03], [1.0, -0.97], reference), stiffness, damping, behind, out)
    theta, w = out[3:] if at_load else out[:2]
    true = {"theta_m": theta, "w_m": w, "i_q": out[2]}
    noisy = {name: x + NOISE[name] * rng.standard_normal(len(t)) for name, x in true.items()}
    return Record((Cycle(0, {"t": t, **noisy}),))
