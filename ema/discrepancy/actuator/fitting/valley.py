"""Valleys: pairs of parameters whose product a record tells far better than either.

A gear that gives rings at 1/√(C J): the record tells C J to a ten-thousandth, and J by the torque that it takes. The
columns of the two are long and nearly cancel where C J stays as it is, so that their noise hides which way that is. So
the first of a pair is moved along the valley: its difference is taken with the product held, and a step follows the
product.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ema.core.records import Array
from ema.effects import registry

Values = Mapping[str, float]


def pairs(names: Sequence[str]) -> dict[str, str]:
    """Of each parameter that is moved along a valley the one that follows, where both are among `names`."""
    found = {}
    for effect in registry().values():
        if effect.product is not None:
            along, follows = (f"{effect.name}.{name}" for name in effect.product)
            if {along, follows} <= {*names}:
                found[along] = follows
    return found


def hold_product(point: Values, moved: Values, along: str, follows: str) -> dict[str, float]:
    """`moved`, in which `along` has another value than at `point`, with the product of the two held."""
    return {**moved, follows: point[follows] * point[along] / moved[along]}


def step_by_product(point: Values, moved: Values, names: Sequence[str]) -> dict[str, float]:
    """What follows after a step, so that each pair has the product of first order, and not that of two steps."""
    found = {}
    for along, follows in pairs(names).items():
        x, y = (point.get(name, 0.0) for name in (along, follows))
        found[follows] = (x * y + x * (moved[follows] - y) + y * (moved[along] - x)) / moved[along]
    return found


def slopes(point: Values, names: Sequence[str]) -> Array:
    """By how much each parameter changes, by row, as one of them, by column, moves along its valley: (n, n).

    A Jacobian times this has differences along valleys; times its inverse, those have its columns.
    """
    S = np.eye(len(names))
    for along, follows in pairs(names).items():
        S[names.index(follows), names.index(along)] = -point.get(follows, 0.0) / point[along]
    return S
