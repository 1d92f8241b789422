"""One stream: the frames of one message of one actuator, in the order of their sequence numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntEnum

from .e2e_state import Result, StateMachine
from .header import N_SEQUENCES, ahead
from .speakers import Speakers

MAX_AHEAD = 64  # frames that may be lost in a row without the stream being taken for another one
SILENCE_NS = 50_000_000  # a sender that has restarted was silent for longer
MAX_MISSING = 256  # how many lost frames are remembered, to tell a late frame from a repeated one


class Check(IntEnum):
    """What the protection says of one frame. Up to REORDERED its data are good."""

    OK = 0
    SOME_LOST = 1  # good, frames before it are missing
    REORDERED = 2  # good, but late: it was missing
    REPEATED = 3  # seen before
    WRONG_COUNTER = 4  # far off the sequence
    CRC_ERROR = 5
    WRONG_LENGTH = 6  # length or format is not that of the DBC
    FOREIGN = 7  # no message of this receiver
    REFUSED = 8  # whole, but message authentication says it is forged, replayed or without its seal


GOOD = Check.REORDERED  # checks up to this one carry data


@dataclass(slots=True)
class Counts:
    """What happened to frames, each kind by itself."""

    n_good: int = 0  # frames whose data were used, late ones included
    n_lost: int = 0  # missing from their sequence and not come late
    n_reordered: int = 0
    n_repeated: int = 0
    n_wrong_counter: int = 0
    n_crc_error: int = 0
    n_wrong_length: int = 0
    n_foreign: int = 0
    n_refused: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


@dataclass(slots=True)
class Stream:
    """Sequence tracking and E2E state of one identifier.

    A frame up to MAX_AHEAD ahead of the last one is taken as the next with losses between; one behind is late if
    it was missing, else repeated. One farther off is refused, so that stray frames, old ones sent again by someone
    for example, cannot pull the sequence away. When frames continue from there, the sender has restarted and the
    stream follows: at once after a silence, else after as many frames as may be lost in a row. Should the sequence
    it has left go on after all, it returns.
    """

    data_id: int
    length: int
    timeout_ns: int
    period_ns: int = 1_000_000  # of its frames while they are sent, at least
    machine: StateMachine = field(default_factory=StateMachine)
    counts: Counts = field(default_factory=Counts)
    expected: int = -1  # next sequence number; -1 before the first frame
    steady: bool = False
    last_ns: int = 0
    n_restarts: int = 0  # of the sender, as far as this stream shows them
    _stray: int = -1  # sequence number of the last frame far off, -1: none since the last good one
    _n_strays: int = 0  # in sequence
    _left: int = -1  # what was expected before the stream followed another sequence, -1: it has not
    _followed: int = 0  # where that began
    _missing: dict[int, None] = field(default_factory=dict)  # lost sequence numbers, oldest first
    speakers: Speakers = field(init=False)

    def __post_init__(self) -> None:
        self.speakers = Speakers(MAX_AHEAD)

    def refuse(self, check: Check) -> Check:
        """Count a frame whose length or CRC is wrong, or that is not authentic: the last says nothing of the stream."""
        if check is Check.REFUSED:
            self.counts.n_refused += 1
            return check
        if check is Check.CRC_ERROR:
            self.counts.n_crc_error += 1
        else:
            self.counts.n_wrong_length += 1
        self._update(Result.ERROR)
        return check

    def place(self, sequence: int, t_ns: int) -> Check:
        """Judge a frame with correct CRC by its sequence number; the caller keeps `last_ns`."""
        check = self._judge(sequence, t_ns)
        if check <= GOOD:
            self.speakers.go_on(t_ns)
        elif check is Check.WRONG_COUNTER:
            self.speakers.stray()
        self._update(Result.OK if check <= GOOD else Result.OTHER)
        return check

    def begin_anew_after_silence(self, t_ns: int) -> None:
        """See whether the frame received at `t_ns` ends a silence: by the frames' own times, in replay as live.

        The stream then begins anew with whatever comes: a sender that was restarted counts from its beginning.
        """
        if not self.timeout_ns or self.expected < 0 or t_ns - self.last_ns <= self.timeout_ns:
            return
        self.machine.time_out()
        self.steady = False
        self.expected = -1

    def _judge(self, sequence: int, t_ns: int) -> Check:
        counts = self.counts
        distance = 0 if self.expected < 0 else ahead(sequence, self.expected)
        if -MAX_AHEAD <= distance < 0:
            if sequence in self._missing:
                del self._missing[sequence]
                counts.n_lost -= 1
                counts.n_reordered += 1
                counts.n_good += 1
                return Check.REORDERED
            counts.n_repeated += 1
            return Check.REPEATED
        if self.expected < 0:
            self.speakers.come(sequence, t_ns)
        if not 0 <= distance <= MAX_AHEAD:
            self.speakers.come(sequence, t_ns)
            if self._returns(sequence):
                distance = ahead(sequence, self._left)
                self._left = -1
            elif self._has_restarted(sequence, t_ns):
                self._left, self._followed = self.expected, sequence
                self.speakers.leave(self.expected, t_ns)
                self.n_restarts += 1
                distance = 0
            else:
                self._stray = sequence
                counts.n_wrong_counter += 1
                return Check.WRONG_COUNTER
            self._missing.clear()
        for lost in range(sequence - distance, sequence):
            self._missing[lost % N_SEQUENCES] = None
        while len(self._missing) > MAX_MISSING:
            del self._missing[next(iter(self._missing))]
        self.expected = (sequence + 1) % N_SEQUENCES
        self._stray, self._n_strays = -1, 0
        counts.n_lost += distance
        counts.n_good += 1
        return Check.SOME_LOST if distance else Check.OK

    def _has_restarted(self, sequence: int, t_ns: int) -> bool:
        """Whether frames far off the sequence are its continuation; counts those that follow one another."""
        continues = self._stray >= 0 and 0 < ahead(sequence, self._stray) <= MAX_AHEAD
        self._n_strays = self._n_strays + 1 if continues else 0
        return continues and (t_ns - self.last_ns > SILENCE_NS or self._n_strays > MAX_AHEAD)

    def _returns(self, sequence: int) -> bool:
        """Whether the sequence left a short while ago goes on."""
        lately = ahead(self.expected, self._followed) <= MAX_MISSING
        return self._left >= 0 and lately and 0 <= ahead(sequence, self._left) <= MAX_AHEAD

    def _update(self, result: Result) -> None:
        self.machine.update(result)
        self.steady = self.machine.steady
