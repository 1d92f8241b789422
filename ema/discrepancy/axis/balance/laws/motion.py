"""Angle, speed, acceleration and the drive's torque along the motion, as the laws of the balance see them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array

MOST_WAVES = 128  # orders whose waves are kept: those of a ripple, and the lines of a model


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

    @cached_property
    def waves(self) -> Callable[[float], tuple[Array, Array]]:
        """cos nθ and sin nθ of an order n; of the last ones asked for they are kept.

        None of it where it passes faster than half the rate: sampled there, it would look like a slow one.
        """

        @lru_cache(maxsize=MOST_WAVES)
        def of(order: float) -> tuple[Array, Array]:
            seen = np.clip(2.0 - np.abs(order * self.sweep) / (0.5 * np.pi), 0.0, 1.0)  # fades from half of that on
            return seen * np.cos(order * self.theta), seen * np.sin(order * self.theta)

        return of
