"""Windows of one record, one after the other in contiguous arrays."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array

from .whitening import Filter, join
from .windows import Bench, Window

MEMORY = 1.0  # [s] for which a load behind a gear is followed before a window


class Pack:
    """Windows of one record, one after the other in contiguous arrays."""

    def __init__(self, bench: Bench, indices: list[int], windows: list[Window], filters: list[Filter]):
        self.bench, self.indices, self.windows = bench, indices, windows
        self.offsets = np.concatenate(([0], np.cumsum([w.n for w in windows]))).astype(np.int64)
        self.t = np.concatenate([w.t for w in windows])
        self.drive = np.concatenate([w.drive for w in windows])
        self.position = np.concatenate([w.position for w in windows])
        self.outputs = np.concatenate([w.outputs for w in windows], axis=1)
        self.dT = np.array([w.dT for w in windows])
        ways = [np.unique(np.sign(w.speed)) for w in windows]
        self.slide = np.array([way[0] if len(way) == 1 else 0.0 for way in ways])
        directions = [w.direction for w in windows if w.direction is not None]
        self.direction = np.concatenate(directions) if directions else None
        self.filter = join(filters) if filters else None

    def drive_by(self, clock: float) -> Array:
        """The drive at the samples of the motion, where it has a clock of its own."""
        return self.drive if clock == 0.0 else np.concatenate([w.drive_by(clock) for w in self.windows])

    @cached_property
    def history(self) -> tuple[NDArray[np.int64], Array, Array, Array, NDArray[np.bool_]]:
        """Recorded motion before each window since the one before it.

        Offsets, time, position, speed, and whether it follows.
        """
        parts, follows = [], []
        last: tuple[int, int] | None = None
        for w in self.windows:
            t = w.before[0]
            first = max(0, int(np.searchsorted(t, t[-1] - MEMORY)))
            follows.append(last is not None and last[0] == w.chain and first < last[1] <= len(t))
            first = last[1] - 1 if follows[-1] and last is not None else first
            parts.append(tuple(x[first:] for x in w.before))
            last = (w.chain, len(t))
        offsets = np.concatenate(([0], np.cumsum([len(t) for t, *_ in parts]))).astype(np.int64)
        t, theta, speed = (np.concatenate(column) for column in zip(*parts, strict=True))
        return offsets, t, theta, speed, np.array(follows)

    def split(self, rows: Array) -> dict[int, Array]:
        """Columns of `rows` by block."""
        edges = self.offsets.tolist()
        return {j: rows[:, a:b] for j, a, b in zip(self.indices, edges[:-1], edges[1:], strict=True)}
