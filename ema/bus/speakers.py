"""Does one sender speak in a stream of frames, or do two? Told by their numbers and contents, without a key.

Whoever knows the DBC can send frames that pass every check. But the genuine sender goes on, and so there is

- one sequence that goes on, again and again, after frames that are not of it: far off, or with a number that was there
  before and other contents. What a controller repeats is the same to the last bit, and a sender that was restarted has
  no other left to go on;
- or a return to a sequence that was left, or a step to a number that neither losses nor a restart explain: who was
  restarted counts from 0.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from .header import ahead

_AGAIN_NS = 1_000_000_000  # gone on once is chance (a stale frame, a restart), twice within this time is somebody
_LEFT_NS = 10_000_000_000  # how long a sequence that was left is remembered: some test cycles
_N_LEFT = 4  # such sequences


@dataclass(slots=True)
class Crossings:
    """Frames of two sequences that alternate."""

    strange: bool = False  # whether the last frame was not of the sequence
    _crossed_ns: int = -_AGAIN_NS

    def go_on(self, t_ns: int) -> bool:
        """The sequence goes on with a frame received at `t_ns`; whether this shows two senders."""
        if not self.strange:
            return False
        self.strange = False
        again = abs(t_ns - self._crossed_ns) <= _AGAIN_NS
        self._crossed_ns = t_ns
        return again


@dataclass(slots=True)
class Speakers:
    """The evidence in the numbers of one stream; contents are compared where frames are kept, in `ema.monitor`.

    Attributes
    ----------
    window : int
        A frame so far ahead of what was expected goes on with its sequence.
    """

    window: int
    two: bool = False  # whether the last frame has shown two; whoever asks takes it back
    _crossings: Crossings = field(default_factory=Crossings)
    _left: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=_N_LEFT))  # next number, when

    def go_on(self, t_ns: int) -> None:
        """A good frame."""
        self.two |= self._crossings.go_on(t_ns)

    def stray(self) -> None:
        """A frame far off the sequence, which is not followed."""
        self._crossings.strange = True

    def leave(self, expected: int, t_ns: int) -> None:
        """A sequence is not followed any more."""
        self._left.append((expected, t_ns))
        self._crossings.strange = False

    def come(self, sequence: int, t_ns: int) -> None:
        """A frame that is not of the sequence followed, if any; a small number is that of a sender just restarted."""
        if sequence <= self.window:
            return
        for expected, left_ns in self._left:
            self.two |= 0 <= ahead(sequence, expected) <= self.window and abs(t_ns - left_ns) <= _LEFT_NS
