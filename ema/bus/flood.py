"""Whether others send more than any CAN bus carries, so that their frames are in the way of those that are wanted."""

from __future__ import annotations

from .load import frame_time

# An empty CAN FD frame at 1 Mbit/s and 8 Mbit/s: no controller hears more of them in a second.
MOST_FRAMES = 1.0 / frame_time(0, 1e6, 8e6)  # [1/s]
_WINDOW = 1.0  # [s]


class Flood:
    """Counts foreign frames by the second.

    Attributes
    ----------
    flooded : bool
        Whether more came in the last second than a bus carries.
    """

    def __init__(self) -> None:
        self.flooded = False
        self._begin = 0.0
        self._n_foreign = self._drops = 0

    def note(self, n_foreign: int, drops: int, now: float) -> None:
        """So many foreign frames were read by `now` [s]; `drops`: how many frames the kernel has dropped so far."""
        self._n_foreign += n_foreign
        lasted = now - self._begin
        if lasted >= _WINDOW:
            came = self._n_foreign + drops - self._drops  # what is dropped among foreign frames is mostly foreign
            self.flooded = self._n_foreign > 0 and came / lasted > MOST_FRAMES
            self._begin, self._n_foreign, self._drops = now, 0, drops
