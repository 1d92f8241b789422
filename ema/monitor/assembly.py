"""Cycle assembly of one actuator: from frames that passed the protection, in their order, to cycles.

A cycle is closed by CycleEnd, by the CycleStart of the next one, or when its frames stop coming. Time is that of the
frames themselves: the same frames in the same order give the same cycles, live or replayed, in batches of any size.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ema.bus.codec import Codec
from ema.bus.header import N_SEQUENCES
from ema.bus.span import SAMPLES_PER_FRAME, Span
from ema.bus.speakers import Crossings
from ema.bus.stream import GOOD, Check
from ema.core import frames as fr
from ema.core.names import CURRENTS
from ema.core.status import Reason

from .cycles import AssembledCycle, Tally
from .track import Track

CONTESTED_NS = 2_000_000_000  # a cycle that ends so soon after two senders were seen may be of either
NEVER = int(np.iinfo(np.int64).max)
_NOTHING = Reason(0)
_GOOD, _REPEATED = int(GOOD), int(Check.REPEATED)  # as plain numbers: looked at for every few frames
_OF_TALLY = (
    Reason.LOST_FRAMES, Reason.REORDERED_FRAMES, Reason.REPEATED_FRAMES, Reason.CORRUPT_FRAMES, Reason.AUTHENTICATION,
)  # fmt: skip


class Due(NamedTuple):
    """An open cycle is to be closed after the first `n_taken` frames of a batch, at `t_ns`."""

    n_taken: int
    t_ns: int
    reasons: Reason


class Assembly:
    """Cycles of one actuator.

    Parameters
    ----------
    codec : Codec
    actuator : int
    n_samples : int
        Current samples of a cycle; cycles of another length are not assembled.
    timeout_ns, grace_ns : int
        See MonitorSettings. [ns]
    """

    def __init__(self, codec: Codec, actuator: int, n_samples: int, timeout_ns: int, grace_ns: int):
        self.actuator = actuator
        self.n_samples = n_samples
        self._codec = codec
        self._timeout_ns, self._grace_ns = timeout_ns, grace_ns
        plan = Span(0, 0, 0, n_samples, 0.0, 0)
        self._currents, self._motions = Track(plan.n_currents), Track(plan.n_motions)
        self._checks = np.zeros(len(Check), int)  # of PhaseCurrents since the last cycle was closed, by check
        self._n_refused = 0  # of any message, since then
        self._crossings = Crossings(), Crossings()  # of PhaseCurrents, of Motion
        self._contested_ns = -CONTESTED_NS  # when two senders were last seen
        self._dropped = False
        self._span: Span | None = None
        self._reasons = _NOTHING
        self._latest_ns = 0  # of the open cycle's frames
        self._end_ns = NEVER  # when CycleEnd came, if frames are still waited for
        self.closed: int | None = None  # number of the last cycle closed or skipped
        self.previous: int | None = None  # of the one before it

    @property
    def open(self) -> bool:
        """Whether a cycle is open."""
        return self._span is not None

    def time_left(self, next_current: int) -> float:
        """Until the open cycle's last currents come, when `next_current` is the sequence number of the next. [s]"""
        if self._span is None:
            return np.inf
        n_left = (self._span.last_current + 1 - next_current) % N_SEQUENCES
        return n_left * SAMPLES_PER_FRAME * self._span.period

    def place(self, currents: np.ndarray, checks: np.ndarray, motions: np.ndarray, motion_checks: np.ndarray) -> None:
        """Take frames of PhaseCurrents and of Motion with their checks."""
        self._checks += np.bincount(checks, minlength=self._checks.size)
        good = fr.chosen(currents, checks <= _GOOD)
        self._currents.put(good)
        self._motions.put(fr.chosen(motions, motion_checks <= _GOOD))
        self._compare(self._currents, self._crossings[0], currents, checks)
        self._compare(self._motions, self._crossings[1], motions, motion_checks)
        if good.size:
            self._latest_ns = max(self._latest_ns, int(good["t_ns"].max()))

    def _compare(self, track: Track, crossings: Crossings, frames: np.ndarray, checks: np.ndarray) -> None:
        """Look for a sequence that goes on after frames with the same numbers and other contents."""
        strange = checks == _REPEATED
        if strange.any():
            strange[strange] = track.contradicts(frames[strange])
        elif not crossings.strange:
            return
        for t_ns, is_strange, check in zip(frames["t_ns"].tolist(), strange.tolist(), checks.tolist(), strict=True):
            if is_strange:
                crossings.strange = True
            elif check <= _GOOD and crossings.go_on(t_ns):
                self._contested_ns = max(self._contested_ns, t_ns)

    def note_contested(self, t_ns: np.ndarray) -> None:
        """Frames of these times have shown that two send in this actuator's name."""
        if t_ns.size:
            self._contested_ns = max(self._contested_ns, int(t_ns.max()))

    def note_refused(self, count: int) -> None:
        """So many frames in this actuator's name were not authentic."""
        self._n_refused += count

    def note_drop(self) -> None:
        """The kernel dropped frames, of whom is not known."""
        self._dropped = True

    def may_be_due(self, t_ns: int) -> bool:
        """Whether a frame of this time might close the open cycle; cheap, and mostly not."""
        return self._span is not None and (self._end_ns < NEVER or t_ns > self._latest_ns + self._timeout_ns)

    def due(self, t_ns: np.ndarray, own: np.ndarray, numbers: np.ndarray) -> Due | None:
        """When a batch closes the open cycle, other than by a cycle's start or end.

        Parameters
        ----------
        t_ns : array, shape (n,)
            Times of all frames on the bus.
        own : array of bool, shape (n,)
            Which are good frames of this actuator's PhaseCurrents.
        numbers : array, shape (n,)
            Their sequence numbers.
        """
        if self._span is None or not t_ns.size:
            return None
        latest = np.maximum.accumulate(np.where(own, t_ns, self._latest_ns))
        before = np.concatenate(([self._latest_ns], np.maximum(latest[:-1], self._latest_ns)))
        limit = np.minimum(before + self._timeout_ns, self._end_ns)
        late = _first(t_ns > limit)
        if self._end_ns < NEVER:
            complete = _first(own & (numbers == self._span.last_current % N_SEQUENCES))
            if complete < late:
                return Due(complete + 1, int(t_ns[complete]), _NOTHING)
        if late < t_ns.size:
            ended = self._end_ns < NEVER
            return Due(late, int(t_ns[late]), _NOTHING if ended else Reason.TIMEOUT | Reason.NO_END)
        return None

    def start(self, span: Span, t_ns: int) -> list[AssembledCycle]:
        """CycleStart: the cycle it closes, if any."""
        if self._span is not None and self._span.cycle == span.cycle:
            return []
        cycles = self._interrupt(t_ns)
        self._begin(span, t_ns)
        return cycles

    def end(self, span: Span, t_ns: int) -> list[AssembledCycle]:
        """CycleEnd: the cycles it closes."""
        cycles = self._interrupt(t_ns) if self._span is not None and self._span.cycle != span.cycle else []
        if self._span is None:
            if self.closed == span.cycle:
                return cycles
            self._begin(span, t_ns)
            self._reasons |= Reason.NO_START
        self._span = span
        if self._currents.has(span.last_current % N_SEQUENCES):
            cycles.append(self.close(t_ns))
        else:
            self._end_ns = t_ns + self._grace_ns
        return cycles

    def skip(self, number: int, t_ns: int) -> list[AssembledCycle]:
        """A cycle that is not to be assembled begins or ends: the cycle it closes, if any."""
        cycles = self._interrupt(t_ns)
        self.previous, self.closed = self.closed, number
        return cycles

    def finish(self) -> list[AssembledCycle]:
        """No more frames will come: the open cycle, if any."""
        return self._interrupt(self._latest_ns)

    def close(self, t_ns: int, reasons: Reason = _NOTHING) -> AssembledCycle:
        """Close the open cycle."""
        span = self._span
        assert span is not None
        self._span, self._end_ns = None, NEVER
        self.previous, self.closed = self.closed, span.cycle
        currents, present = self._currents.take(span.first_current, span.n_currents)
        tally = self._take_tally(int((~present).sum()))
        i = self._codec.messages["PhaseCurrents"].decode(currents)
        dropped, self._dropped = self._dropped, False
        return AssembledCycle(
            t_ns=t_ns,
            actuator=self.actuator,
            span=span,
            i=np.stack([i[name].ravel()[: span.n_samples] for name in CURRENTS]),
            missing=np.repeat(~present, SAMPLES_PER_FRAME)[: span.n_samples],
            motion=self._motion(span),
            tally=tally,
            reasons=self._reasons
            | reasons
            | _seen(tally)
            | (Reason.KERNEL_DROPS if dropped else _NOTHING)
            | (Reason.TWO_SPEAKERS if t_ns - self._contested_ns <= CONTESTED_NS else _NOTHING),
        )

    def _interrupt(self, t_ns: int) -> list[AssembledCycle]:
        if self._span is None:
            return []
        return [self.close(t_ns, _NOTHING if self._end_ns < NEVER else Reason.NO_END)]

    def _begin(self, span: Span, t_ns: int) -> None:
        self._span, self._reasons, self._latest_ns = span, _NOTHING, t_ns

    def _take_tally(self, n_lost: int) -> Tally:
        n = self._checks
        bad = n[Check.CRC_ERROR] + n[Check.WRONG_LENGTH] + n[Check.WRONG_COUNTER]
        tally = Tally(n_lost, int(n[Check.REORDERED]), int(n[Check.REPEATED]), int(bad), self._n_refused)
        self._checks, self._n_refused = np.zeros_like(n), 0
        return tally

    def _motion(self, span: Span) -> dict[str, np.ndarray]:
        frames, present = self._motions.take(span.first_motion, span.n_motions)
        values = self._codec.messages["Motion"].decode(frames)
        return {
            name: np.where(present[:, None], x, np.nan).ravel()[: span.n_motion_samples] for name, x in values.items()
        }


def _first(condition: np.ndarray) -> int:
    """Index of the first true element; the length if there is none."""
    index = int(condition.argmax()) if condition.size else 0
    return index if condition.size and condition[index] else condition.size


def _seen(tally: Tally) -> Reason:
    reasons = _NOTHING
    for count, reason in zip(tally, _OF_TALLY, strict=True):
        reasons |= reason if count else _NOTHING
    return reasons
