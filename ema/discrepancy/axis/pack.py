"""Windows of one record, one after the other in contiguous arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array

from .whitening import Filter, join
from .windows import Bench, Window

History = tuple[NDArray[np.int64], Array, Array, Array, NDArray[np.bool_]]
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
        self._histories: dict[float, History] = {}  # the last one asked for

    def drive_by(self, clock: float) -> Array:
        """The drive at the samples of the motion, where it has a clock of its own."""
        return self.drive if clock == 0.0 else np.concatenate([w.drive_by(clock) for w in self.windows])

    def history(self, late: float = 0.0) -> History:
        """Motion before each window since the one before it, of a position that is recorded `late`. [s]

        Offsets, time, position, speed, and whether it follows.
        """
        if late not in self._histories:
            self._histories = {late: self._history(late)}
        return self._histories[late]

    def _history(self, late: float) -> History:
        parts, follows = [], []
        chain, last = -1, 0.0
        for w in self.windows:
            t, theta, speed = w.around
            end = min(w.t[0] + late, t[-1])
            first = max(end - MEMORY, t[0])
            follows.append(chain == w.chain and first <= last <= end)
            at = np.array([last if follows[-1] else first, end])
            at = np.unique(np.concatenate((at, t[(t > at[0]) & (t < end)])))
            parts.append((at, np.interp(at, t, theta), np.interp(at, t, speed)))
            chain, last = w.chain, end
        offsets = np.concatenate(([0], np.cumsum([len(t) for t, *_ in parts]))).astype(np.int64)
        t, theta, speed = (np.concatenate(column) for column in zip(*parts, strict=True))
        return offsets, t, theta, speed, np.array(follows)

    def split(self, rows: Array) -> dict[int, Array]:
        """Columns of `rows` by block."""
        edges = self.offsets.tolist()
        return {j: rows[:, a:b] for j, a, b in zip(self.indices, edges[:-1], edges[1:], strict=True)}
