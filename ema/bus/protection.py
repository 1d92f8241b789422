"""AUTOSAR E2E Profile 5 on every frame, in and out: who sent it, is it whole, is it the next one?"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np
from e2e.p05 import e2e_p05_check, e2e_p05_protect

from ema.core.frames import FRAME_DTYPE, FrameFlag

from . import identifiers
from .codec import Codec
from .e2e_state import StreamState
from .header import N_SEQUENCES, ahead, sequence
from .stream import GOOD, MAX_AHEAD, Check, Counts, Stream

__all__ = ["GOOD", "Check", "Counts", "Receiver", "Sender", "Stream", "StreamState"]

_ROW = FRAME_DTYPE.itemsize
_DATA = FRAME_DTYPE.fields["data"][1]  # type: ignore[index]
_SELDOM = 0.05  # what has no period is sent no more often than this [s]
_FORMAT = int(FrameFlag.EXTENDED | FrameFlag.FD)
_REFUSED = int(FrameFlag.REFUSED)
_FORMAT_MASK = _FORMAT | _REFUSED | int(FrameFlag.REMOTE | FrameFlag.ERROR)
RESTART_NS = 500_000_000  # an actuator that is on is heard ten times a second


class Sender:
    """Fills the header of outgoing frames: sequence number of their identifier, then the CRC."""

    def __init__(self) -> None:
        self._next: dict[int, int] = {}

    def next_sequence(self, frame_id: int) -> int:
        """Sequence number the next frame of this identifier will get."""
        return self._next.get(frame_id, 0)

    def skip(self, frame_id: int, count: int = 1) -> None:
        """Leave out sequence numbers, as if frames had been sent and lost."""
        self._next[frame_id] = (self.next_sequence(frame_id) + count) % N_SEQUENCES

    def protect(self, frames: np.ndarray) -> np.ndarray:
        """Fill the headers in place, in order; returns `frames`, shape (n,), dtype FRAME_DTYPE, contiguous."""
        raw = frames.view(np.uint8).data
        rows = zip(frames["id"].tolist(), frames["length"].tolist(), strict=True)
        for start, (frame_id, length) in enumerate(rows):
            begin = start * _ROW + _DATA
            number = self.next_sequence(frame_id)
            self._next[frame_id] = (number + 1) % N_SEQUENCES
            raw[begin + 2] = number & 0xFF
            raw[begin + 3] = number >> 8
            data_id = identifiers.data_id(frame_id)
            e2e_p05_protect(raw[begin : begin + length], data_id, increment_counter=False)
        return frames


class Receiver:
    """Checks incoming frames, one stream for each identifier.

    Parameters
    ----------
    codec : Codec
    messages : names
        What is received; frames of other messages are foreign. All by default.
    actuators : numbers
        Whose frames are received. All by default.
    """

    def __init__(self, codec: Codec, messages: Collection[str] | None = None, actuators: Collection[int] | None = None):
        self._codec = codec
        self._messages = codec.messages.keys() if messages is None else set(messages)
        self._actuators = range(identifiers.N_ACTUATORS) if actuators is None else set(actuators)
        self._n_foreign = 0
        self.streams: dict[int, Stream] = {}  # by identifier
        self.contested: list[int] = []  # frames of the last batch that show that two send in one's name

    def check(self, frames: np.ndarray) -> np.ndarray:
        """Judge a batch of frames.

        Parameters
        ----------
        frames : array, shape (n,), dtype FRAME_DTYPE

        Returns
        -------
        checks : array of uint8, shape (n,)
            Check values; data are good where ``checks <= GOOD``.
        """
        frames = np.ascontiguousarray(frames)
        raw = frames.view(np.uint8).data
        checks, self.contested = bytearray(frames.size), []
        streams = self.streams
        columns = (frames["id"], frames["flags"] & _FORMAT_MASK, frames["length"], sequence(frames), frames["t_ns"])
        begin = _DATA - _ROW
        for n, (frame_id, form, length, number, t_ns) in enumerate(
            zip(*(column.tolist() for column in columns), strict=True)
        ):
            begin += _ROW
            stream = streams.get(frame_id) or self._open(frame_id)
            if stream is None:
                self._n_foreign += 1
                checks[n] = Check.FOREIGN
            elif length != stream.length or form & ~_REFUSED != _FORMAT:
                checks[n] = stream.refuse(Check.WRONG_LENGTH)
            elif not e2e_p05_check(raw[begin : begin + length], stream.data_id):
                checks[n] = stream.refuse(Check.CRC_ERROR)
            elif form != _FORMAT:
                checks[n] = stream.refuse(Check.REFUSED)
            elif number == stream.expected and stream.steady:  # the usual case: nothing but the next frame
                stream.expected = (number + 1) % N_SEQUENCES
                stream.counts.n_good += 1
                stream.last_ns = t_ns
            else:
                stream.begin_anew_after_silence(t_ns)
                if t_ns - self._last_heard(frame_id) > RESTART_NS:
                    self._begin_anew(self._siblings(frame_id))
                n_restarts, expected, last_ns = stream.n_restarts, stream.expected, stream.last_ns
                check = checks[n] = stream.place(number, t_ns)
                if stream.n_restarts > n_restarts:
                    others = [other for other in self._siblings(frame_id) if other is not stream]
                    self._explain(stream, others, number, ahead(number, expected), t_ns, last_ns)
                    self._begin_anew(others)
                if stream.speakers.two:
                    stream.speakers.two = False
                    self.contested.append(n)
                if check <= GOOD:
                    stream.last_ns = t_ns
        return np.frombuffer(checks, np.uint8)

    @property
    def heard(self) -> dict[int, int]:
        """Good frames so far, by identifier."""
        return {frame_id: stream.counts.n_good for frame_id, stream in self.streams.items()}

    @property
    def counts(self) -> Counts:
        """What happened, over all streams."""
        return sum((stream.counts for stream in self.streams.values()), Counts(n_foreign=self._n_foreign))

    def _siblings(self, frame_id: int) -> list[Stream]:
        number = identifiers.actuator(frame_id)
        return [s for other, s in self.streams.items() if s.expected >= 0 and identifiers.actuator(other) == number]

    def _last_heard(self, frame_id: int) -> int:
        """When the last good frame of the same actuator came. [ns]"""
        return max((stream.last_ns for stream in self._siblings(frame_id)), default=0)

    @staticmethod
    def _explain(stream: Stream, others: Iterable[Stream], number: int, n_ahead: int, t_ns: int, last_ns: int) -> None:
        """Why a stream goes on elsewhere: frames were lost, its sender was restarted, or it is another one.

        Losses are no more than was sent meanwhile; twice the rate is allowed, for bursts. A sender that was restarted
        counts from 0, in all of its streams: if one of them goes on, it was not.
        """
        most = MAX_AHEAD + 2 * (t_ns - last_ns) / stream.period_ns
        if 0 < n_ahead <= most:
            return
        if number > most:
            stream.speakers.two = True
        for other in others:
            other.speakers.leave(other.expected, t_ns)

    @staticmethod
    def _begin_anew(streams: Iterable[Stream]) -> None:
        """Take the next frame of each as it comes: its actuator has been restarted, or may have been.

        It may have been after a long silence, and it has been when one of its streams shows it: then all of them
        count from their beginning. The rare ones need to be told: CycleStart a few cycles after a restart looks like an
        old one sent again.
        """
        for stream in streams:
            stream.expected = -1

    def _open(self, frame_id: int) -> Stream | None:
        message = self._codec.find(frame_id)
        if message is None or message.name not in self._messages:
            return None
        if identifiers.actuator(frame_id) not in self._actuators:
            return None
        data_id, period_ns = identifiers.data_id(frame_id), round((message.period or _SELDOM) * 1e9)
        stream = Stream(data_id, message.length, round(message.timeout * 1e9), period_ns)
        self.streams[frame_id] = stream
        return stream
