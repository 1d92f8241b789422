"""Motions that an actuator may be asked to make, to tell causes apart that a record could not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.records import Array
from ema.models.actuator import Actuator

FAST, SLOW = 0.25, 0.03  # shares of the speed without load, V_dc / (2 k_e)
AWAY = 0.25  # of the travel, from where it was recorded


@dataclass(frozen=True)
class Motion:
    """A commanded user position at the control rate [rad], and what it is in words."""

    said: str
    command: Array


def motions(plant: Actuator, centre: float) -> list[Motion]:
    """A handful that differ in speed, reversals and place, about `centre`."""
    turn = 2.0 * np.pi / plant.transmission.GR  # of the rotor, at the user [rad]
    w = plant.inverter.V_dc / (2.0 * plant.motor.k_e) / plant.transmission.GR
    fast, slow = FAST * w, SLOW * w

    def times(duration: float) -> Array:
        return np.arange(round(duration * plant.control.rate) + 1) / plant.control.rate

    def sine(amplitude: float, at: float = centre) -> Array:
        return np.asarray(at + amplitude * np.sin(fast / amplitude * times(0.5)))

    t = times(0.8)
    triangle = turn * 2.0 / np.pi * np.arcsin(np.sin(0.5 * np.pi * slow / turn * t))
    t = times(0.5)
    steps = 0.5 * turn * np.round(np.sin(2.0 * np.pi * 4.0 * t + 1e-9))
    chirp = 0.2 * turn * np.sin(0.5 * fast / (0.2 * turn) * t**2 / t[-1])
    away = AWAY * plant.transmission.theta_stop
    way = -1.0 if centre > 0.0 else 1.0  # towards the middle and beyond, which is never outside the travel
    return [
        Motion(f"a slow triangle of ±{_mrad(turn)} mrad at {_mrad(slow)} mrad/s", centre + np.asarray(triangle, float)),
        Motion(f"a fast sine of ±{_mrad(turn)} mrad, up to {_mrad(fast)} mrad/s", sine(turn)),
        Motion(f"steps of ±{_mrad(0.5 * turn)} mrad, four times a second", centre + np.asarray(steps, float)),
        Motion(f"a chirp of ±{_mrad(0.2 * turn)} mrad, up to {_mrad(fast)} mrad/s", centre + np.asarray(chirp, float)),
        Motion(f"the fast sine {_mrad(away)} mrad away from where it was recorded", sine(turn, centre + way * away)),
    ]


def _mrad(x: float) -> str:
    return f"{1e3 * x:.3g}"
