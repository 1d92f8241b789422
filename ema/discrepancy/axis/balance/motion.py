"""Angle, speed, acceleration and the drive's torque along the motion, as the laws of the balance see them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array


@dataclass(frozen=True)
class Motion:
    """The samples of all courses in one row: arrays of shape (n_samples,).

    `drive` is the drive's torque; `known` what is left of it to accelerate the axis, by the plant file.
    `direction` is ±1 or, where the axis may rest, 0. `has_position` is False where the position was integrated.
    `dT` is the winding's temperature less 20 °C [K]; `gear_orders` are those at which a gear may err, per turn.
    `turns` is how often the load turns for one turn of the recorded side.
    `other` is angle, speed and acceleration of a neighbouring axis, which is the `neighbour` "inner" or "outer" one.
    `record` is which of `records` a sample is of.
    """

    t: Array
    theta: Array
    w: Array
    a: Array
    drive: Array
    known: Array
    direction: Array
    has_position: bool
    static: NDArray[np.bool_]
    other: tuple[Array, Array, Array] = (np.empty(0), np.empty(0), np.empty(0))
    neighbour: str = ""
    record: NDArray[np.int_] = field(default_factory=lambda: np.empty(0, int))
    records: tuple[str, ...] = ()
    dT: Array = field(default_factory=lambda: np.empty(0))
    gear_orders: tuple[float, ...] = ()
    turns: float = 1.0

    @cached_property
    def sweep(self) -> Array:
        """The way from one sample to the next, at the usual rate of each record. [rad or m]"""
        out = np.zeros(len(self.t))
        for k in np.unique(self.record):
            own = self.record == k
            steps = np.diff(self.t[own])
            out[own] = self.w[own] * float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        return out
