"""Typical sizes in an axis' records, by which searches are scaled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .measured import Measured


@dataclass(frozen=True)
class Sizes:
    """Typical sizes in the records: rms of drive torque, speed, drive, voltage; extent of position; sample period."""

    torque: float
    speed: float
    drive: float
    current: float
    voltage: float
    centre: float
    half_range: float
    period: float


def sizes(plant: Measured) -> Sizes:
    """Sizes over all records; the largest where records differ."""
    p = plant.plant
    moving = [w for w in plant.windows if not w.static] or list(plant.windows)
    drive = _rms(np.concatenate([w.drive for w in plant.windows]))
    speed = _rms(np.concatenate([w.speed for w in moving])) or 1.0
    k_t = float(p.k_t or 1.0)
    current, voltage = drive, 1.0
    if p.drive == "voltage":
        current, voltage = drive / max(float(p.R or 1.0), 1e-9), drive
        for b in plant.benches:
            if "i_q" in b.roles.outputs:
                row = b.roles.outputs.index("i_q")
                current = _rms(np.concatenate([w.outputs[row] for w in b.windows]))
    elif p.drive == "speed-loop":
        current = max(p.F_d, 1e-12) / k_t + p.inertia * speed / k_t
    for b in plant.benches:
        if "u_q" in b.roles.outputs and not b.static:
            row = b.roles.outputs.index("u_q")
            voltage = max(voltage if voltage != 1.0 else 0.0, _rms(np.concatenate([w.outputs[row] for w in b.windows])))
    torque = drive if p.is_force else k_t * current
    position = np.concatenate([w.position for w in moving])
    low, high = float(position.min()), float(position.max())
    period = max((w.period for w in moving if not w.static), default=1e-3)
    return Sizes(torque, speed, drive, current, voltage, 0.5 * (low + high), max(0.5 * (high - low), 1e-12), period)


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))
