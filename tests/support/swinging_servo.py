"""A servo whose gear gives: a motor by voltage, a spring, and an arm whose angle alone is measured and fed back.

The loop swings at the resonance of the gear, as a quick servo does that hunts. No code of the library.
"""

from __future__ import annotations

from math import copysign, sin, tanh

import numpy as np

PERIOD, INNER = 4e-3, 80  # [s], steps within one
J_M, J_L, STIFFNESS, DAMPING = 0.07, 0.02, 70.0, 0.15  # [kg m²], at the arm; [N m/rad], [N m s/rad]
GRAVITY, F_M, F_L = 0.62, 0.05, 0.02  # [N m]
K_T, R, SUPPLY = 2.0, 3.0, 12.0  # [N m/A], at the arm; [ohm], [V]
NOISE = 4e-4  # [rad]


def simulate(seconds: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Time, angle of the arm, voltage of the motor; held from each sample to the next."""
    t = np.arange(0.0, seconds, PERIOD)
    wanted = 0.8 * np.sin(2.0 * t) + 0.3 * np.sin(5.3 * t + 0.7) + 0.1 * np.sin(11.0 * t)
    theta, u, h = np.zeros(len(t)), np.zeros(len(t)), PERIOD / INNER
    motor = w_motor = arm = w_arm = before = 0.0
    for j, target in enumerate(wanted):
        duty = 6.0 * (target - arm) - 0.2 * (arm - before) / PERIOD
        before = theta[j] = arm
        u[j] = SUPPLY * (duty if abs(duty) < 1.0 else copysign(1.0, duty))
        for _ in range(INNER):
            twist = STIFFNESS * (motor - arm) + DAMPING * (w_motor - w_arm)
            w_motor += h * (K_T * (u[j] - K_T * w_motor) / R - twist - F_M * tanh(w_motor / 0.01)) / J_M
            w_arm += h * (twist - GRAVITY * sin(arm) - F_L * tanh(w_arm / 0.01)) / J_L
            motor, arm = motor + h * w_motor, arm + h * w_arm
    return {"t": t, "theta_m": theta + NOISE * np.random.default_rng(seed).standard_normal(len(t)), "u_q": u}
