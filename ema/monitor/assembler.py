"""From everything on a bus to the cycles of each actuator: protection, then assembly, frame by frame in their order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.header import sequence
from ema.bus.protection import Receiver
from ema.bus.span import N_CYCLES, Span
from ema.bus.stream import GOOD, Check
from ema.core import frames as fr
from ema.core.frames import FrameFlag, is_overflow
from ema.core.status import Reason
from ema.models.actuator import Actuator

from .assembly import Assembly, Due
from .cycles import AssembledCycle
from .outputs import Event, Level
from .settings import MonitorSettings

_ERROR, _TX = int(FrameFlag.ERROR), int(FrameFlag.TX)
_ODD = np.uint8(_ERROR | _TX)
_GOOD, _REFUSED = int(GOOD), int(Check.REFUSED)  # as plain numbers: looked at for every few frames
RECEIVED = ("CycleStart", "CycleEnd", "PhaseCurrents", "Motion", "Supply")
_MANY = 512  # frames that wait at most


class _Batch(NamedTuple):
    """Checked frames with what is asked of them again and again."""

    frames: np.ndarray
    checks: np.ndarray
    t_ns: np.ndarray
    message: np.ndarray  # identifier of the DBC message
    actuator: np.ndarray
    contested: np.ndarray  # whether it shows that two send in its actuator's name
    mark: np.ndarray  # whether it is a CycleStart or CycleEnd, good or not, or says that frames were dropped

    def part(self, begin: int, end: int) -> _Batch:
        return _Batch(*(column[begin:end] for column in self))


def _joined(batches: list[_Batch]) -> _Batch:
    if len(batches) == 1:
        return batches[0]
    if not batches:
        return _Batch(
            fr.empty(0), *(np.zeros(0, kind) for kind in (np.uint8, np.int64, np.uint32, np.uint32, bool, bool))
        )
    frames, *columns = zip(*batches, strict=True)
    return _Batch(fr.joined(frames), *map(np.concatenate, columns))


class Assembler:
    """Cycles of all actuators on one bus.

    Parameters
    ----------
    codec : Codec
    plants : mapping of actuator number to Actuator
        Whose cycles are assembled; their test motion says how long a cycle is.
    settings : MonitorSettings
    """

    def __init__(self, codec: Codec, plants: Mapping[int, Actuator], settings: MonitorSettings):
        self.receiver = Receiver(codec, RECEIVED, plants)
        self._codec = codec
        self._plants = plants
        self._waiting: list[_Batch] = []
        self._n_waiting = 0
        self._contested: set[int] = set()  # actuators in whose name two were sending
        self._chirp = codec.number("CycleStart", "motion_kind", "chirp")
        self._ids = {name: codec.messages[name].frame_id for name in RECEIVED}
        self._start, self._end, self._currents, self._motion, _ = self._ids.values()
        timeout_ns, grace_ns = round(settings.timeout * 1e9), round(settings.grace * 1e9)
        self._assemblies = {
            number: Assembly(codec, number, plant.n_samples, timeout_ns, grace_ns) for number, plant in plants.items()
        }

    def feed(self, frames: np.ndarray) -> Iterator[AssembledCycle | Event]:
        """Take frames in the order they were received, shape (n,); cycles as they close, and what was odd."""
        batch = self._gathered(self._checked(frames))
        if batch is None:
            return
        marks = batch.mark & ((batch.checks <= _GOOD) | is_overflow(batch.frames))
        begin = 0
        for mark in [*np.flatnonzero(marks).tolist(), None]:
            end = len(batch.frames) if mark is None else mark + 1
            yield from self._place(batch.part(begin, end))
            if mark is not None:
                yield from self._mark(batch.part(mark, end))
            begin = end

    def finish(self) -> Iterator[AssembledCycle | Event]:
        """Close what is open, because no more frames will come."""
        yield from self._place(_joined(self._waiting))
        self._waiting, self._n_waiting = [], 0
        for assembly in self._assemblies.values():
            for cycle in assembly.finish():
                yield from self._closed(assembly, cycle)

    def ends_within(self, duration: float) -> bool:
        """See Monitor."""
        for number, assembly in self._assemblies.items():
            if assembly.open:
                stream = self.receiver.streams.get(identifiers.with_actuator(self._currents, number))
                if stream is not None and assembly.time_left(stream.expected) <= duration:
                    return True
        return False

    @property
    def heard(self) -> dict[tuple[int, str], int]:
        """See Monitor."""
        names = {message_id: name for name, message_id in self._ids.items()}
        return {(identifiers.actuator(i), names[identifiers.message_id(i)]): n for i, n in self.receiver.heard.items()}

    def _gathered(self, batch: _Batch) -> _Batch | None:
        """The frames that wait to be placed, once there is a reason to: placing a few costs as much as placing many.

        What is placed later is placed the same: the frames' own times decide, not the batches.
        """
        if not batch.frames.size:
            return None
        self._waiting.append(batch)
        self._n_waiting += batch.frames.size
        latest_ns = int(batch.t_ns.max())
        if not (
            self._n_waiting >= _MANY
            or batch.mark.any()
            or any(assembly.may_be_due(latest_ns) for assembly in self._assemblies.values())
        ):
            return None
        gathered, self._waiting, self._n_waiting = _joined(self._waiting), [], 0
        return gathered

    def _checked(self, frames: np.ndarray) -> _Batch:
        if not np.bitwise_or.reduce(frames["flags"]) & _ODD:
            checks, shown, notices = self.receiver.check(frames), self.receiver.contested, None
        else:
            sent, error = ((frames["flags"] & flag) != 0 for flag in (_TX, _ERROR))
            frames = fr.chosen(frames, ~sent & (~error | is_overflow(frames)))
            notices = is_overflow(frames)
            data = np.flatnonzero(~notices)
            checks = np.full(frames.size, Check.FOREIGN, np.uint8)
            checks[data] = self.receiver.check(fr.chosen(frames, data))
            shown = data[self.receiver.contested].tolist()
        contested = np.zeros(frames.size, bool)
        if shown:
            contested[shown] = True
        ids = frames["id"]
        message = identifiers.message_id(ids)
        mark = (message == self._start) | (message == self._end)
        if notices is not None:
            mark |= notices
        t_ns = frames["t_ns"].view(np.int64)
        return _Batch(frames, checks, t_ns, message, identifiers.actuator(ids), contested, mark)

    def _place(self, batch: _Batch) -> Iterator[AssembledCycle | Event]:
        """Place frames; a cycle whose time runs out, or whose last frame comes, is closed at that frame."""
        while True:
            due, assembly = self._first_due(batch)
            taken = batch if due is None else batch.part(0, due.n_taken)
            self._take(taken)
            if due is None or assembly is None:
                return
            yield from self._closed(assembly, assembly.close(due.t_ns, due.reasons))
            batch = batch.part(due.n_taken, len(batch.frames))

    def _first_due(self, batch: _Batch) -> tuple[Due | None, Assembly | None]:
        first: tuple[Due | None, Assembly | None] = (None, None)
        if not batch.frames.size:
            return first
        latest_ns = int(batch.t_ns.max())
        open_ones = [assembly for assembly in self._assemblies.values() if assembly.may_be_due(latest_ns)]
        if not open_ones:
            return first
        currents = (batch.message == self._currents) & (batch.checks <= _GOOD)
        numbers = sequence(batch.frames)
        for assembly in open_ones:
            due = assembly.due(batch.t_ns, currents & (batch.actuator == assembly.actuator), numbers)
            if due is not None and (first[0] is None or due.n_taken < first[0].n_taken):
                first = due, assembly
        return first

    def _take(self, batch: _Batch) -> None:
        if not batch.frames.size:
            return
        currents = batch.message == self._currents
        motions = batch.message == self._motion
        refused, contested = batch.checks == _REFUSED, batch.contested
        any_refused, any_contested = refused.any(), contested.any()
        for number in self._assemblies.keys() & set(batch.actuator.tolist()):
            own, assembly = batch.actuator == number, self._assemblies[number]
            mine, moves = np.flatnonzero(own & currents), np.flatnonzero(own & motions)
            assembly.place(
                fr.chosen(batch.frames, mine), batch.checks[mine], fr.chosen(batch.frames, moves), batch.checks[moves]
            )
            if any_contested:
                assembly.note_contested(batch.t_ns[own & contested])
            if any_refused:
                assembly.note_refused(int(np.count_nonzero(own & refused)))

    def _mark(self, mark: _Batch) -> Iterator[AssembledCycle | Event]:
        """A good CycleStart or CycleEnd, or the notice that frames were dropped."""
        if mark.checks[0] == Check.FOREIGN:
            for assembly in self._assemblies.values():
                assembly.note_drop()
            return
        starts = int(mark.message[0]) == self._start
        values = self._codec.messages["CycleStart" if starts else "CycleEnd"].decode(mark.frames)
        span = Span(**{name: values[name][0].item() for name in Span._fields})
        t_ns, number = int(mark.t_ns[0]), int(mark.actuator[0])
        assembly = self._assemblies[number]
        odd = _misfit(span, self._plants[number], self._chirp)
        if odd:
            if assembly.closed != span.cycle:
                yield Event(t_ns, Level.WARNING, "other_motion", f"cycle {span.cycle} is not looked at: {odd}", number)
            cycles = assembly.skip(span.cycle, t_ns)
        else:
            cycles = assembly.start(span, t_ns) if starts else assembly.end(span, t_ns)
        for cycle in cycles:
            yield from self._closed(assembly, cycle)

    def _closed(self, assembly: Assembly, cycle: AssembledCycle) -> Iterator[AssembledCycle | Event]:
        previous, number = assembly.previous, cycle.span.cycle
        if previous is not None and number != (previous + 1) % N_CYCLES:
            text = (
                f"cycles {previous + 1}…{number - 1} were not seen" if number > previous + 1
                else f"cycle {number} follows cycle {previous}: the actuator has restarted"
            )  # fmt: skip
            yield Event(cycle.t_ns, Level.WARNING, "cycles_missing", text, assembly.actuator)
        contested = bool(cycle.reasons & Reason.TWO_SPEAKERS)
        if contested != (assembly.actuator in self._contested):
            self._contested ^= {assembly.actuator}
            yield _told_of_speakers(cycle, contested)
        yield cycle


def _told_of_speakers(cycle: AssembledCycle, two: bool) -> Event:
    number = cycle.span.cycle
    if two:
        text = f"cycle {number}: two senders speak in this actuator's name; nothing is made of their frames"
        return Event(cycle.t_ns, Level.ERROR, "two_speakers", text, cycle.actuator)
    text = f"cycle {number}: one sender alone speaks in this actuator's name again"
    return Event(cycle.t_ns, Level.INFO, "one_speaker", text, cycle.actuator)


def _misfit(span: Span, plant: Actuator, chirp: int) -> str:
    """What of a cycle is not the plant's test motion; empty if it is."""
    period = 1.0 / plant.control.rate
    if span.motion_kind != chirp:
        return f"its motion is of kind {span.motion_kind}, the bundle's is a chirp ({chirp})"
    if span.n_samples != plant.n_samples:
        return f"it has {span.n_samples} samples, the bundle's has {plant.n_samples}"
    if abs(span.period - period) > 1e-6 * period:
        return f"its sampling period is {span.period:g} s, the bundle's is {period:g} s"
    return ""
