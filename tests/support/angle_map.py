"""A map of the torque that turns a motor slowly forth and back: dry friction and lines locked to the rotor."""

from __future__ import annotations

import numpy as np

from ema.core.records import Cycle, Record

DRY, NOISE = 3.5e-3, 2.5e-4
OWN = ((8e-3, 36.0, 0.4), (2.5e-3, 72.0, -1.1))
NEIGHBOUR = ((3e-3, 14.0, 0.9), (1.2e-3, 28.0, -0.2))


def turned(lines):
    """The same with the other sign."""
    return tuple((-amplitude, n, phase) for amplitude, n, phase in lines)


def record(lines, seed, *, zero=0.0, drift=0.0):
    """`zero`: what the encoder counts less than the angle; `drift` of dry friction over the map."""
    rng = np.random.default_rng(seed)
    up = np.linspace(0.0, 2.0 * np.pi, 900, endpoint=False)
    theta, direction = np.concatenate([up, up[::-1]]), np.repeat([1.0, -1.0], len(up))
    torque = DRY * direction * (1.0 + drift * np.linspace(0.0, 1.0, len(theta)))
    torque += sum(amplitude * np.sin(n * theta + phase) for amplitude, n, phase in lines)
    torque += NOISE * rng.standard_normal(len(theta))
    t = np.arange(float(len(theta)))
    return Record((Cycle(0, {"t": t, "theta_m": theta - zero, "w_m": np.zeros(len(t)), "torque": torque}),))


def plant(F_d=DRY):
    """What its maker would write."""
    return {"kind": "axis", "drive": "torque", "J": 1e-4, "F_d": F_d}
