"""Windows of one record, one after the other in contiguous arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ema.core.records import Array
from ema.discrepancy.axis.reading.windows import Bench, Window
from ema.models import axis

from .whitening import Filter, join

History = tuple[NDArray[np.int64], Array, Array, Array, Array, Array, NDArray[np.bool_]]
MEMORY = 1.0  # [s] for which what is beyond a gear is followed before a window


@dataclass(frozen=True)
class LedIn:
    """Windows with up to `n` samples of motion before each; `own` are the samples of the windows themselves."""

    n: int
    offsets: NDArray[np.int64]
    t: Array
    drive: Array
    load: Array
    own: NDArray[np.bool_] | slice

    @classmethod
    def of(cls, windows: list[Window], n: int) -> LedIn:
        """Led in by `n` samples, where the axis was moving by then as it does in the window."""
        t, drive, load = zip(*(w.led_in(n) for w in windows), strict=True)
        own = [np.arange(len(at)) >= len(at) - w.n for at, w in zip(t, windows, strict=True)]
        offsets = np.concatenate(([0], np.cumsum([len(at) for at in t]))).astype(np.int64)
        return cls(n, offsets, np.concatenate(t), np.concatenate(drive), np.concatenate(load), np.concatenate(own))


class Pack:
    """Windows of one record, one after the other in contiguous arrays."""

    def __init__(self, bench: Bench, indices: list[int], windows: list[Window], filters: list[Filter]):
        self.bench, self.indices, self.windows = bench, indices, windows
        self.offsets = np.concatenate(([0], np.cumsum([w.n for w in windows]))).astype(np.int64)
        self.t = np.concatenate([w.t for w in windows])
        self.drive = np.concatenate([w.drive for w in windows])
        self.load = np.concatenate([w.load for w in windows])
        self.position = np.concatenate([w.position for w in windows])
        self.outputs = np.concatenate([w.outputs for w in windows], axis=1)
        self.dT = np.array([w.dT for w in windows])
        ways = [np.unique(np.sign(w.speed)) for w in windows]
        self.slide = np.array([way[0] if len(way) == 1 else 0.0 for way in ways])
        directions = [w.direction for w in windows if w.direction is not None]
        self.direction = np.concatenate(directions) if directions else None
        self.filter = join(filters) if filters else None
        bare = LedIn(0, self.offsets, self.t, self.drive, self.load, slice(None))
        self._led_in = {0: bare}  # and the last other one asked for
        self._histories: dict[tuple[float, int], History] = {}  # the last one asked for
        self._acting: dict[tuple[float, str], dict[int, Array]] = {}  # the same

    def led_in(self, back: float) -> LedIn:
        """The windows with the motion before each that still acts in it, `back` at the most. [s]

        That is what a late sensor shows, and the voltage that made its current.
        """
        n = math.ceil(back / self.windows[0].period - 1e-9)
        if n not in self._led_in:
            self._led_in = {0: self._led_in[0], n: LedIn.of(self.windows, n)}
        return self._led_in[n]

    def drive_by(self, model: axis.Model, led_in: LedIn, between: str) -> Array:
        """The drive there, where it has a clock of its own, or is followed with a lag."""
        clock, lag = axis.clock_of_drive(model), axis.lag_of_drive(model, self.bench.roles.kind)
        if lag == 0.0:
            return np.concatenate([w.drive_by(clock, led_in.n) for w in self.windows]) if any(clock) else led_in.drive
        acting = self._after_lag(lag, between)
        return np.concatenate([w.drive_by(clock, led_in.n, acting[w.part.number]) for w in self.windows])

    def _after_lag(self, lag: float, between: str) -> dict[int, Array]:
        """What acts of the drive, by part."""
        if (lag, between) not in self._acting:
            parts = {w.part.number: w.part for w in self.windows}.values()
            found = {part.number: axis.acting_drive(lag, part.t, part.drive, between) for part in parts}
            self._acting = {(lag, between): found}
        return self._acting[lag, between]

    def history(self, late: float = 0.0, n: int = 0) -> History:
        """Motion up to `n` samples before each window, since that of the one before, of a position recorded `late`. [s]

        Offsets, time, position, speed, drive, known load, and whether it follows.
        """
        if (late, n) not in self._histories:
            self._histories = {(late, n): self._history(late, n)}
        return self._histories[late, n]

    def _history(self, late: float, n: int) -> History:
        parts, follows = [], []
        number, last = -1, 0.0
        for w in self.windows:
            t, theta, speed = w.part.t, w.part.recorded, w.part.speed
            end = min(t[w.begin(n)] + late, t[-1])
            first = max(end - MEMORY, t[0])
            follows.append(number == w.part.number and first <= last <= end)
            at = np.array([last if follows[-1] else first, end])
            at = np.unique(np.concatenate((at, t[(t > at[0]) & (t < end)])))
            given = (np.interp(at - late, t, x) for x in (w.part.drive, w.part.load))
            parts.append((at, np.interp(at, t, theta), np.interp(at, t, speed), *given))
            number, last = w.part.number, end
        offsets = np.concatenate(([0], np.cumsum([len(t) for t, *_ in parts]))).astype(np.int64)
        t, theta, speed, drive, load = (np.concatenate(column) for column in zip(*parts, strict=True))
        return offsets, t, theta, speed, drive, load, np.array(follows)

    def split(self, rows: Array) -> dict[int, Array]:
        """Columns of `rows` by block."""
        edges = self.offsets.tolist()
        return {j: rows[:, a:b] for j, a, b in zip(self.indices, edges[:-1], edges[1:], strict=True)}
