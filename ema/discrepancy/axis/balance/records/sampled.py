"""The motion along courses: smoothed, with the torque that the drive gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ema.core.records import Array
from ema.discrepancy.axis.balance.laws.motion import Motion
from ema.discrepancy.axis.reading.smooth import local_polynomial
from ema.models import axis
from ema.models.axis_layout import row

from .course import Course

if TYPE_CHECKING:
    from ema.discrepancy.axis.reading.measured import Measured

CREEP = 0.02  # of the rms speed: below, friction at rest and in sliding mix
SEEN = 3.0  # deviations of the smoothed speed that show a direction


def smooth_motion(plant: Measured, model: axis.Model, c: Course, half: float) -> Motion:
    """Motion along a course, smoothed over a half width. [s]"""
    n_half = max(3, round(half / c.period))
    if c.position is not None:
        theta, w, a = local_polynomial(c.t, c.position, n_half, 3)[:3]
        noise = c.noise.get("position", 0.0) / (n_half**1.5 * c.period)
    elif c.speed is not None:
        w, a = local_polynomial(c.t, c.speed, n_half, 2)[:2]
        noise = c.noise.get("speed", 0.0) / n_half**0.5
        theta = cumulative_trapezoid(w, c.t, initial=0.0)
    theta = theta + c.zero
    rest = max(SEEN * noise, CREEP * float(np.sqrt(np.mean(w**2))))
    direction = np.where(np.abs(w) > rest, np.sign(w), 0.0)
    i, drive = _current(c, w, model.z)
    is_force = c.bench.roles.kind == "force"
    known = axis.torque_along(model, theta, w, i, c.t, c.dT, c.load, force=is_force)
    by_angle, slope = axis.inertia_by_angle(model, theta)
    known -= by_angle * a + slope * w**2  # of the momentum, what is not the mean inertia's
    still = np.zeros(len(w), bool)
    motion = Motion(c.t, theta, w, a, drive, known, direction, c.position is not None, still, dT=c.dT)
    motion = replace(motion, gear_orders=tuple(plant.plant.gear_orders), turns=_turns(plant))
    if c.other is None or plant.plant.neighbour is None:
        return motion
    psi, v, accelerates = local_polynomial(c.t, c.other, n_half, 3)[:3]
    return replace(motion, other=(psi, v, accelerates), neighbour=plant.plant.neighbour)


def _turns(plant: Measured) -> float:
    return 1.0 / plant.plant.gear if plant.plant.measured_at == "motor" else 1.0


def at_rest(plant: Measured, model: axis.Model, c: Course) -> Motion:
    """An axis that is held at rest, reading by reading."""
    assert c.position is not None
    assert c.direction is not None
    k_t = 1.0 if plant.plant.is_force else float(plant.plant.k_t or 1.0)
    theta = c.position + c.zero
    held = axis.holding(model, theta, c.direction, c.t, c.load)
    zero = np.zeros(len(c.t))
    drive = k_t * c.drive
    return Motion(
        c.t, theta, zero, zero, drive, drive - k_t * held, c.direction, True, np.ones(len(c.t), bool), dT=c.dT
    )  # fmt: skip


def join(motions: Sequence[Motion]) -> Motion:
    """The samples of several motions in one row."""

    def of(name: str) -> Array:
        return np.concatenate([getattr(m, name) for m in motions])

    columns = (of("t"), of("theta"), of("w"), of("a"), of("drive"), of("known"), of("direction"))
    motion = Motion(*columns, all(m.has_position for m in motions), of("static").astype(bool), dT=of("dT"))
    motion = replace(motion, gear_orders=motions[0].gear_orders, turns=motions[0].turns)
    if not all(m.neighbour for m in motions):
        return motion
    psi, v, a = (np.concatenate([m.other[k] for m in motions]) for k in range(3))
    return replace(motion, other=(psi, v, a), neighbour=motions[0].neighbour)


def _current(c: Course, w: Array, z: Array) -> tuple[Array, Array]:
    """Current (or force) along the motion, and the drive's torque."""
    kind, k_t = c.bench.roles.kind, float(z[row("k_t")])
    at = c.t - c.late * c.period
    drive = (np.interp(at, c.t, c.drive) - z[row("drive_offset.offset")]) / (1.0 + z[row("drive_gain.gain")])
    if kind == "force":
        return drive, drive
    if c.current is not None:
        drive = c.current
    elif kind == "voltage":  # quasi-static: the electrical time constant is shorter than a test function
        drive = (drive - z[row("k_e")] * w) / max(float(z[row("R")]), 1e-9)
    elif kind == "speed-loop":
        drive = np.clip(z[row("K_w")] * (drive - w), -z[row("I_max")], z[row("I_max")])
    return drive, k_t * drive
