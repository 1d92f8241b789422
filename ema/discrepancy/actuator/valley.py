"""Valleys: pairs of parameters whose product a record tells far better than either.

A gear that gives rings at 1/√(C J): the record tells C J to a ten-thousandth, and J by the torque that it takes. The
columns of the two are long and nearly cancel where C J stays as it is, so that their noise hides which way that is. So
the first of a pair is moved along the valley: its difference is taken with the product held, and a step follows the
product.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ema.core.records import Array
from ema.discrepancy.plant import Point
from ema.effects import registry

from .free import Free


def pairs(frees: Sequence[Free]) -> dict[str, str]:
    """Of each parameter that is moved along a valley the one that follows, where both are free."""
    names = {f.name for f in frees}
    found = {}
    for effect in dict.fromkeys(name.split(".")[0] for name in names if "." in name):
        if (product := registry()[effect].product) is not None:
            along, follows = (f"{effect}.{name}" for name in product)
            if {along, follows} <= names:
                found[along] = follows
    return found


def hold_product(point: Point, moved: Point, along: str, follows: str) -> Point:
    """`moved`, in which `along` has another value than at `point`, with the product of the two held."""
    return {**moved, follows: point[follows] * point[along] / moved[along]}


def step_by_product(point: Point, moved: Point, frees: Sequence[Free]) -> Point:
    """`moved` with that product of each pair which first order says, instead of the product of two steps."""
    found = dict(moved)
    bounds = {f.name: (f.low, f.high) for f in frees}
    for along, follows in pairs(frees).items():
        x, y = (point.get(name, 0.0) for name in (along, follows))
        product = x * y + x * (moved[follows] - y) + y * (moved[along] - x)
        found[follows] = float(np.clip(product / moved[along], *bounds[follows]))
    return found


def slopes(point: Point, frees: Sequence[Free]) -> Array:
    """By how much each parameter changes, by row, as one of them, by column, moves along its valley: (n_free, n_free).

    A Jacobian times this has differences along valleys; times its inverse, those have its columns.
    """
    names = [f.name for f in frees]
    S = np.eye(len(names))
    for along, follows in pairs(frees).items():
        S[names.index(follows), names.index(along)] = -point.get(follows, 0.0) / point[along]
    return S
