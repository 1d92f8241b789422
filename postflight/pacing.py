"""When each frame of a replay is due."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ema.core import frames as raw
from ema.log.reader import FrameBatch

_BACK = 1.0  # a clock that jumps back by more was set: no frame waits for it to catch up [s]
_WINDOW_NS = 500_000_000  # batches of several buses overlap by no more


class Pace:
    """Times of frames on the replay's own clock.

    Parameters
    ----------
    speed : float
        Recorded seconds per second; infinite: all at once.
    longest_gap : float
        A longer silence in the log is shortened to this. [recorded s]
    """

    def __init__(self, speed: float = 1.0, longest_gap: float = np.inf):
        self._speed, self._longest = speed, longest_gap
        self._last_ns: int | None = None
        self._elapsed = 0.0  # at the last frame [recorded s]

    def due(self, t_ns: np.ndarray) -> np.ndarray:
        """Seconds after the replay's start at which frames are due, shape (n,); called with all frames in turn."""
        if not len(t_ns):
            return np.zeros(0)
        t = t_ns.astype(np.int64)
        first = int(t[0]) if self._last_ns is None else self._last_ns
        steps = np.diff(t, prepend=first) / 1e9
        steps[steps < -_BACK] = 0.0
        elapsed = self._elapsed + np.cumsum(np.minimum(steps, self._longest))
        self._last_ns, self._elapsed = int(t[-1]), float(elapsed[-1])
        return elapsed / self._speed

    def again(self) -> None:
        """The log begins anew; its first frame follows the last one at once."""
        self._last_ns = None


class Traffic(NamedTuple):
    """Frames of several buses: `frames[i]` was on `buses[bus[i]]`."""

    buses: list[str]
    bus: np.ndarray
    frames: np.ndarray


def merged(batches: Iterable[FrameBatch]) -> Iterator[Traffic]:
    """Frames of all buses in the order of their times, those of each bus in the order they were received."""
    buses: list[str] = []
    latest: dict[str, int] = {}  # time reached on each bus
    bus, time, frames = np.zeros(0, np.int64), np.zeros(0, np.int64), raw.empty(0)
    for name, batch in batches:
        if name not in buses:
            buses.append(name)
        t_ns = batch["t_ns"].astype(np.int64)
        if t_ns[0] < max(latest.values(), default=0) - _BACK * 1e9:  # the clock was set back
            yield Traffic(buses, bus, frames)
            bus, time, frames, latest = bus[:0], time[:0], frames[:0], {}
        reached = np.maximum.accumulate(np.append(latest.get(name, 0), t_ns))[1:]
        latest[name] = int(reached[-1])
        bus = np.append(bus, np.full(len(batch), buses.index(name)))
        time = np.append(time, reached)
        frames = np.concatenate((frames, batch))
        order = np.argsort(time, kind="stable")
        bus, time, frames = bus[order], time[order], frames[order]
        ready = int(np.searchsorted(time, max(latest.values()) - _WINDOW_NS))
        yield Traffic(buses, bus[:ready], frames[:ready])
        bus, time, frames = bus[ready:], time[ready:], frames[ready:]
    yield Traffic(buses, bus, frames)
