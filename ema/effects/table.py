"""A torque tabulated over one quantity: the form of what was found in data as a function without a known cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numba import njit

from .base import Parameter

KNOTS = tuple(f"torque_{n}" for n in range(10))  # at even distances, the first at `low` and the last at `high`
LIMIT = 0.3  # [N m], a fifth of what the motor can


@njit(inline="always")
def hat(u):
    """max(0, 1 - |u|)"""
    return max(0.0, 1.0 - abs(u))


@njit(inline="always")
def value(x, low, high, t0, t1, t2, t3, t4, t5, t6, t7, t8, t9):
    """Straight lines between the knots, beyond them as at the ends.   [N m]

    τ(x) = Σ_n τ_n max(0, 1 - |u - n|),   u = 9 (x - low)/(high - low), within 0 … 9
    """
    u = min(max(9.0 * (x - low) / (high - low), 0.0), 9.0)
    return (
        t0 * hat(u) + t1 * hat(u - 1.0) + t2 * hat(u - 2.0) + t3 * hat(u - 3.0) + t4 * hat(u - 4.0)
        + t5 * hat(u - 5.0) + t6 * hat(u - 6.0) + t7 * hat(u - 7.0) + t8 * hat(u - 8.0) + t9 * hat(u - 9.0)
    )  # fmt: skip


def parameters(unit: str, reach: float, quantity: str) -> tuple[Parameter, ...]:
    """Ends of the table, which lie within ±`reach`, and the torque at each knot."""
    part = 0.1 * reach
    ends = (
        Parameter("low", unit, -part, -reach, reach, -part, f"{quantity} of the first value"),
        Parameter("high", unit, part, -reach, reach, part, f"{quantity} of the last value"),
    )
    start = 0.01
    return ends + tuple(
        Parameter(
            name, "N m", 0.0, -LIMIT, LIMIT, start * (-1.0) ** n, f"torque at value {n}, opposing positive motion"
        )
        for n, name in enumerate(KNOTS)
    )


def tabulated(x: Sequence[float] | np.ndarray, torque: Sequence[float] | np.ndarray) -> Mapping[str, float]:
    """Values of a table for a torque [N m] known at ascending places `x`, with straight lines between them."""
    low, high = float(x[0]), float(x[-1])
    knots = np.interp(np.linspace(low, high, len(KNOTS)), x, torque)
    return {"low": low, "high": high, **dict(zip(KNOTS, map(float, knots), strict=True))}
