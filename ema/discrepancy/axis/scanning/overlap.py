"""Where the lines of torque of two records lie over each other: the angle between their zeros."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.axis.reading.measured import Zero

if TYPE_CHECKING:
    from ema.core.records import Array

SAME = 0.98  # of the best overlap: a zero that reaches it is as good, the smallest is taken
TURNED = 0.15  # [rad] of a line, within which all lines lie as they do or turned round, where no zero is off
STEPS = 64  # of δ in one period of the highest order


def between(reference: dict[float, complex], own: dict[float, complex]) -> Zero:
    """Where the zero of a record lies from that of another, by the lines z_n of both."""
    shared = tuple(sorted(reference.keys() & own.keys()))
    if not shared:
        return Zero(None)
    n = np.array(shared)
    products = np.array([reference[k].conjugate() * own[k] for k in shared])
    delta = np.linspace(-math.pi, math.pi, 2 * round(STEPS * n.max() / 2) + 1)
    overlap: Array = (products * np.exp(-1j * np.outer(delta, n))).real.sum(axis=1)
    good = np.flatnonzero(overlap >= SAME * overlap.max())
    if overlap[len(delta) // 2] >= SAME * overlap.max():
        return Zero(0.0, shared)
    near = good[np.argmin(np.abs(delta[good]))]
    peak = good[np.abs(delta[good] - delta[near]) < math.pi / n.max()]
    found = float(delta[peak[np.argmax(overlap[peak])]])
    if (turned := _turned(shared, products)) is not None:
        does = overlap.max() >= SAME * np.abs(products).sum()  # one zero moves all lines, each by its order
        return Zero(0.0, shared, turned, found if does else None)
    return Zero(found, shared)


def _turned(shared: tuple[float, ...], products: Array) -> tuple[float, ...] | None:
    """Lines that have the other sign, where each line that matters lies as it does or just turned round; else None.

    By chance that is so in few zeros of all, and it is in each record where a neighbour turns some lines round.
    """
    size = np.abs(products)
    weighty = size > (1.0 - SAME) * size.max()
    phase = np.abs(np.angle(products))
    if bool((np.minimum(phase, math.pi - phase)[weighty] > TURNED).any()):
        return None
    return tuple(n for n, counts, off in zip(shared, weighty, phase, strict=True) if counts and off > 0.5 * math.pi)
