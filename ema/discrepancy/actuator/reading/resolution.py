"""In what steps a channel was recorded."""

from __future__ import annotations

import numpy as np

from ema.core.records import Array

COUNTED = (4.0, 100.0, np.inf)  # steps between values that a rough, a better and a good step tell apart
OFF_GRID = 0.2  # of a step, by which few decimals may put values beside it


def resolution(x: Array) -> float:
    """Resolution of a channel: the distance of the grid on which its values lie, as few decimals round them, else 0."""
    values = np.unique(np.round(x, 10))  # interpolation leaves rounding
    if len(values) < 3:
        return 0.0
    gaps = np.diff(values)
    step = float(gaps.min())
    if step < 1e-6:
        return 0.0
    for reach in COUNTED:  # few decimals make the least gap too small, the more so the wider ones
        narrow = gaps[gaps < reach * step]
        step = float(narrow.sum() / np.round(narrow / step).sum())
    off = gaps / step
    return step if np.abs(off - np.round(off)).max() < OFF_GRID else 0.0
