"""What the frames of a log hold for the identifiers, read here or in a process beside.

Reading, protection, assembly and the low-pass need no estimate, so they run ahead of the identification in a process of
their own: two cores, the same items in the same order, and a pipe's buffer between them that does not grow.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterable, Iterator, Mapping
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

from ema.alarms import Command, Warmth, in_order
from ema.alarms.bus import Ears
from ema.bundle import Bundle
from ema.bus import codec as codecs
from ema.core.errors import EmaError, LogError
from ema.log import LogReader, Message, schemas
from ema.log.foreign import ForeignLog
from ema.log.scan import Damage
from ema.monitor import Event, Job, MonitorSettings, Reception

from .open_log import names

LONG = 30_000_000  # below this a second process takes longer to start than it saves [B]
_TOGETHER = 16  # items sent at once

Log = LogReader | ForeignLog
Item = Job | Event | Message | Command | Warmth


def received(
    log: Log, bundles: Mapping[int, Bundle], settings: MonitorSettings, channels: tuple[str, ...]
) -> Iterator[Item]:
    """Cycles as jobs, events of their assembly, operators' commands, and what the daemon logged, in the log's order.

    Of what it logged: estimates, alarms, and its own state.

    Raises
    ------
    LogError
        The frames are of several channels, and none was chosen.
    """
    reception, listener = Reception(bundles, codecs.default(), settings), Ears(codecs.default(), bundles)
    wanted = (schemas.FRAMES.topic, "/estimate/", schemas.ALARM.topic, schemas.STATUS.topic)
    entries = log.entries(lambda topic: topic.startswith(wanted)) if isinstance(log, LogReader) else log.frames()
    only = ""
    for entry in entries:
        if isinstance(entry, Message):
            yield entry
        elif not channels or entry.bus in channels:
            only = only or entry.bus
            if entry.bus != only:
                raise LogError(
                    f"{names(log.paths)}: frames of channels '{only}' and '{entry.bus}': choose one by --channel"
                )
            yield from in_order(listener.hear(entry.frames), reception.feed(entry.frames))
    yield from reception.finish()


def worth_a_process(log: Log) -> bool:
    """Whether a second core is there and the log long enough for it."""
    return len(os.sched_getaffinity(0)) > 1 and sum(path.stat().st_size for path in log.paths) > LONG


class _Place(NamedTuple):
    """A log to be opened again."""

    kind: type[LogReader] | type[ForeignLog]
    paths: list[Path]
    start_ns: int | None
    end_ns: int | None

    def open(self) -> Log:
        return self.kind(self.paths, self.start_ns, self.end_ns)


class _End(NamedTuple):
    """The reading is over, or failed by `error`."""

    damage: list[Damage]
    error: EmaError | None


def received_beside(
    log: Log, bundles: Mapping[int, Bundle], settings: MonitorSettings, channels: tuple[str, ...]
) -> Iterator[Item]:
    """As `received`, by a process of its own; damage it meets is noted in `log`."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    place = _Place(type(log), log.paths, log.start_ns, log.end_ns)
    process = context.Process(target=_serve, args=(sender, place, bundles, settings, channels), daemon=True)
    process.start()
    sender.close()
    try:
        while not isinstance(items := _next(receiver), _End):
            yield from items
    finally:
        receiver.close()
        process.terminate()
        process.join()
    if isinstance(log, LogReader):
        log.damage += [damage for damage in items.damage if damage not in log.damage]
    if items.error is not None:
        raise items.error


def _next(receiver: Connection) -> list[Item] | _End:
    try:
        found: list[Item] | _End = receiver.recv()
    except (EOFError, OSError) as error:
        raise LogError("the process that reads the log has ended (is there enough memory?)") from error
    return found


def _serve(
    sender: Connection,
    place: _Place,
    bundles: Mapping[int, Bundle],
    settings: MonitorSettings,
    channels: tuple[str, ...],
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that listens is told, and closes the pipe
    damage: list[Damage] = []
    failure: EmaError | None = None
    try:
        try:
            with place.open() as log:
                damage = getattr(log, "damage", damage)
                for items in _together(received(log, bundles, settings, channels)):
                    sender.send(items)
        except EmaError as error:
            failure = error
        sender.send(_End(damage, failure))
    except BrokenPipeError:
        pass  # nobody listens any more


def _together(items: Iterable[Item]) -> Iterator[list[Item]]:
    part: list[Item] = []
    for item in items:
        part.append(item)
        if len(part) == _TOGETHER:
            yield part
            part = []
    if part:
        yield part
