"""An axis with inertia and friction that follows a sweep exactly: what it is, is known."""

from __future__ import annotations

import numpy as np

from ema.core.records import Cycle, Record

RATE, DURATION = 1000.0, 4.0
J, C, F_D, K_T = 2e-4, 3e-4, 0.01, 0.05


def bench(seed=1, **changes):
    """An axis with inertia and friction that follows a sweep; channels may be replaced by functions of them."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, DURATION, 1.0 / RATE)
    phase = 2.0 * np.pi * (0.5 * t + 0.4 * t**2)
    w = 20.0 * np.sin(phase)
    theta = np.cumsum(w) / RATE
    a = np.gradient(w, t)
    i = (J * a + C * w + F_D * np.sign(w)) / K_T
    channels = {
        "t": t,
        "theta_m": theta + 1e-4 * rng.standard_normal(len(t)),
        "w_m": w + 0.02 * rng.standard_normal(len(t)),
        "i_q": i + 0.002 * rng.standard_normal(len(t)),
    }
    for name, change in changes.items():
        channels[name] = change(channels[name])
    return Record((Cycle(0, channels),))
