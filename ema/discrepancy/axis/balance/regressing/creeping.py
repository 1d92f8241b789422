"""Rows in which the axis creeps: whether friction acts there as in sliding is asked of the others.

A position that creeps by single counts may slide all the time, or stick and slip between two samples. Rows that creep
and slide, by laws that are right, can only help to foretell the others. Where these are foretold better without them,
friction acts otherwise there, and they are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .found import Balance
from .needed import MATTERS
from .rows import Rows

SLOW = 0.1  # of the rms speed
MOST = 0.02  # share of a row in which the axis may be as slow as that
MORE = 2.0  # times the power that rows leave which are not explained as well as the others


def leave_creeping_out(answer: Balance, choose: Callable[[Rows], Balance]) -> Balance:
    """What `choose` finds without the rows that creep, where it foretells the others better than `answer` does."""
    model, quick = answer.model, slides(answer.model.rows)
    if 2 * quick.sum() < len(quick) or quick.all():
        return answer
    if float(np.mean(model.left[~quick] ** 2)) < MORE * float(np.mean(model.left[quick] ** 2)):
        return answer
    other = choose(chosen(model.rows, quick))
    here, there = model.held_out[quick], other.model.held_out
    both = np.isfinite(here) & np.isfinite(there)
    better = float(np.sum(there[both] ** 2)) < (1.0 - MATTERS) * float(np.sum(here[both] ** 2))
    return replace(other, creeps=float(np.mean(~quick))) if better else answer


def slides(rows: Rows) -> NDArray[np.bool_]:
    """Which rows the axis slides through, faster than a share of each record's rms speed."""
    m = rows.motion
    slow = np.zeros(len(m.t))
    for k in range(len(m.records)):
        own = (m.record == k) & ~m.static
        if own.any():
            slow[own] = np.abs(m.w[own]) < SLOW * float(np.sqrt(np.mean(m.w[own] ** 2)))
    return np.asarray(rows.integrate @ slow <= MOST)


def chosen(rows: Rows, own: NDArray[np.bool_]) -> Rows:
    """Some of the rows."""
    named = ("y", "drive", "alpha", "whole", "cluster", "record", "sigma", "integrate", "differentiate")
    _, block = np.unique(rows.block[own], return_inverse=True)
    return replace(rows, **{name: getattr(rows, name)[own] for name in named}, block=block, known={})
