"""Typical sizes in an axis' records, by which searches are scaled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.effects.search import AxisSizes

if TYPE_CHECKING:
    from .measured import Measured


WARMING = 5.0  # [K] by which windings must change temperature to show what it does


def sizes(plant: Measured) -> AxisSizes:
    """AxisSizes over all records; the largest where records differ."""
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
    return AxisSizes(
        torque=torque,
        speed=speed,
        drive=drive,
        current=current,
        voltage=voltage,
        centre=0.5 * (low + high),
        half_range=max(0.5 * (high - low), 1e-12),
        period=max((w.period for w in moving if not w.static), default=1e-3),
        damping=p.C,
        supply=p.V_dc,
        driven_by=p.drive,
        outputs=frozenset(name for b in plant.benches for name in b.roles.outputs),
        fitted=frozenset(p.fitted),
        turns=not p.is_linear,
        moves=any(not w.static for w in plant.windows),
        warms=bool(np.ptp([w.dT for w in plant.windows]) > WARMING),
        is_force=p.is_force,
    )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))
