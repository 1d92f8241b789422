"""The latest frames of one stream, each in the place its sequence number gives it."""

from __future__ import annotations

import numpy as np

from ema.bus.header import N_SEQUENCES, sequence
from ema.bus.stream import MAX_AHEAD
from ema.core import frames as fr


class Track:
    """A ring of frames that have passed the protection.

    The 16-bit sequence number is continued to a position that never repeats: a frame may come up to MAX_AHEAD late;
    any other step back is a restart of the sender and counts forward, so that frames of before are never mistaken for
    those of after.

    Parameters
    ----------
    length : int
        Frames of one cycle; twice as many are kept.
    """

    def __init__(self, length: int):
        capacity = 1 << (2 * length - 1).bit_length()
        self._frames = fr.empty(capacity)
        self._positions = np.full(capacity, -1)  # ~position where it has been taken
        self._last = N_SEQUENCES - 1  # position of the frame received last; its sequence number is the low 16 bits

    def put(self, frames: np.ndarray) -> None:
        """Take frames in the order of their reception, shape (n,)."""
        if not frames.size:
            return
        numbers = sequence(frames).astype(np.int64)
        steps = numbers.copy()
        steps[0] -= self._last
        steps[1:] -= numbers[:-1]
        positions = self._last + np.cumsum((steps + MAX_AHEAD) % N_SEQUENCES - MAX_AHEAD)
        slots = positions % self._frames.size
        fr.place(frames, self._frames, slots)
        self._positions[slots] = positions
        self._last = int(positions[-1])

    def take(self, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Remove the frames of a cycle.

        Parameters
        ----------
        first : int
            Sequence number of the first one.
        count : int
            How many there should be.

        Returns
        -------
        frames : array, shape (count,), FRAME_DTYPE
            Zero where missing.
        present : array of bool, shape (count,)
        """
        positions = self._position(first) + np.arange(count)
        slots = positions % self._frames.size
        present = self._positions[slots] == positions
        frames = fr.chosen(self._frames, slots)
        frames.view(np.uint8).reshape(count, -1)[~present] = 0
        self._positions[slots[present]] = ~positions[present]
        return frames, present

    def contradicts(self, frames: np.ndarray) -> np.ndarray:
        """Which frames have the number of one that was put here and other contents; shape of `frames`."""
        positions = self._last - (self._last - sequence(frames).astype(np.int64)) % N_SEQUENCES
        slots = positions % self._frames.size
        known = (self._positions[slots] == positions) | (self._positions[slots] == ~positions)
        other: np.ndarray = (self._frames["data"][slots] != frames["data"]).any(axis=-1)
        return known & other

    def has(self, number: int) -> bool:
        """Whether the frame with this sequence number, of the newest that had it, is there."""
        position = self._position(number)
        return bool(self._positions[position % self._frames.size] == position)

    def _position(self, number: int) -> int:
        return self._last - (self._last - number) % N_SEQUENCES
