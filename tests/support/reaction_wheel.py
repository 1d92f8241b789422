"""A reaction wheel in a chamber that warms up: its own simulation, in steps of a millisecond, recorded at 20 Hz.

Its speed is known better than any simulation of it needs to be, to 2e-4 of its size, and its drag falls with the
temperature by an exponential. Shares no code with the models that are tested.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from ema.core.records import Cycle, Record

DT, EVERY = 1e-3, 50  # [s] step, and steps between samples
J, C, F, K_T = 1.5e-3, 1.8e-5, 9e-4, 0.025
PER_KELVIN = 0.028
SPEED_NOISE, CURRENT_NOISE, TEMPERATURE_NOISE = 0.035, 2e-3, 0.1
PLANT = {"drive": "current", "k_t": K_T, "J": J, "C": C, "F_d": F, "fitted": ["J", "C"]}


def _reference(rng: np.random.Generator, n: int) -> np.ndarray:
    """Speeds that are held for half a minute, with ramps of 40 rad/s² between them. [rad/s]"""
    out, k, level = np.zeros(n), 0, 0.0
    while k < n:
        new, held = rng.uniform(-280.0, 280.0), int(rng.uniform(15.0, 35.0) / DT)
        ramp = int(abs(new - level) / 40.0 / DT) + 1
        course = np.concatenate([np.linspace(level, new, ramp), np.full(held, new)])[: n - k]
        out[k : k + len(course)] = course
        k, level = k + len(course), new
    a = np.exp(-DT / 0.8)
    return lfilter([1.0 - a], [1.0, -a], out)


def record(seed: int, *, per_kelvin: float = PER_KELVIN, seconds: float = 300.0) -> Record:
    """Current, speed and temperature of a wheel that warms from 20 °C by 15 K or more."""
    rng = np.random.default_rng(seed)
    n = int(seconds / DT)
    t = np.arange(n) * DT
    reference = _reference(rng, n)
    temperature = 20.0 + 22.0 * (1.0 - np.exp(-t / 250.0))
    drag = C * np.exp(-per_kelvin * (temperature - 20.0))
    w, i, integral = np.zeros(n), np.zeros(n), 0.0
    for k in range(n - 1):
        error = reference[k] - w[k]
        integral += error * DT
        i[k] = np.clip((0.004 * error + 0.002 * integral) / K_T, -3.0, 3.0)
        w[k + 1] = w[k] + DT * (K_T * i[k] - drag[k] * w[k] - F * np.tanh(w[k] / 0.5)) / J
    own = slice(0, n - 1, EVERY)

    def seen(x: np.ndarray, sigma: float) -> np.ndarray:
        return x[own] + sigma * rng.standard_normal(len(x[own]))

    channels = {
        "t": t[own],
        "i_q": seen(i, CURRENT_NOISE),
        "w_m": seen(w, SPEED_NOISE),
        "temp_w": seen(temperature, TEMPERATURE_NOISE),
    }
    return Record((Cycle(0, channels),))
