"""When frames arrived, by the monotonic clock: what ages are counted from, whatever the wall clock does."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

_S = 1e-9  # [s/ns]
_OWN_CLOCK = 60.0  # a stamp farther from the wall clock was not made by this machine's kernel [s]
_REMEMBERED = 4096  # cycles; those that wait for a slower identifier are far fewer


class Arrival:
    """Translates the frames' stamps, which are the kernel's wall-clock time of reception.

    The wait in the receive buffer counts. Where stamps are of another clock (a device's own), the time of reading does.
    """

    def __init__(self) -> None:
        self._read = self._offset = 0.0  # when frames were read; that clock less that of the stamps [s]
        self._own = True  # the stamps' clock is this machine's
        self._cycles: OrderedDict[tuple[int, int], float] = OrderedDict()
        self._last: dict[int, float] = {}

    def note(self, frames: np.ndarray, wall_ns: int, now: float) -> None:
        """Frames were read, shape (n,), n > 0, at this wall-clock [ns] and monotonic time [s]."""
        self._read, self._offset = now, now - wall_ns * _S
        self._own = abs(wall_ns - int(frames["t_ns"].max())) * _S <= _OWN_CLOCK

    def of(self, actuator: int, t_ns: int) -> float:
        """Monotonic time at which a cycle's last frame arrived; it stays, whatever is set meanwhile. [s]"""
        key = actuator, t_ns
        if key not in self._cycles:
            arrived = t_ns * _S + self._offset if self._own else self._read
            self._cycles[key] = self._last[actuator] = max(arrived, self._last.get(actuator, arrived))
            if len(self._cycles) > _REMEMBERED:
                self._cycles.popitem(last=False)
        return self._cycles[key]
