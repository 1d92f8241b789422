"""python-can reads and writes these logs: `can_player`, `can_logconvert`, `can_viewer` and every other program of it.

Registered as entry points of the groups `can.io.message_reader` and `can.io.message_writer` for the suffix `.mcap`.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
from can.io.generic import MessageReader, SizedMessageWriter

from ema.core import frames as raw
from ema.core.can_messages import fill, message
from ema.core.errors import LogError

from .batches import MAX_COUNT, Batcher
from .reader import LogReader
from .schemas import FRAMES
from .segment import Segment

_logger = logging.getLogger("ema.log")
_FLUSH_INTERVAL = 1.0  # [s]


class McapReader(MessageReader):
    """Iterates over the raw frames of a log as python-can messages.

    Parameters
    ----------
    file : path
        An MCAP log, whole, unfinished or damaged, or a directory of segments.

    Raises
    ------
    LogError
        `file` is missing or not MCAP.
    """

    def __init__(self, file: str | os.PathLike[str], **options: Any):
        self._log = LogReader(Path(file))

    def __iter__(self) -> Iterator[can.Message]:
        for bus, frames in self._log.frames():
            for frame in frames:
                yield message(frame, bus or None)
        for line in (*self._log.remarks(), *self._log.complaints()):
            _logger.warning("%s", line)

    def stop(self) -> None:
        """Close the file."""
        self._log.close()


class McapWriter(SizedMessageWriter):
    """Writes python-can messages as the raw frames of a log.

    Parameters
    ----------
    file : path
        A new file.

    Raises
    ------
    LogError
        `file` exists (a log is never overwritten) or cannot be written.
    """

    def __init__(self, file: str | os.PathLike[str], append: bool = False, **options: Any):
        if append:
            raise LogError(f"{file}: a finished MCAP file cannot be appended to; give another name")
        path = Path(file)
        try:
            self._segment = Segment(path, time.time_ns(), {}, {"source": "python-can"})
        except FileExistsError as error:
            raise LogError(f"{path}: exists, and is not overwritten") from error
        except OSError as error:
            raise LogError(f"{path}: cannot be written ({error.strerror})") from error
        self._waiting: dict[str, _Waiting] = {}
        self._flushed_at = time.monotonic()
        self._stopped = False

    def on_message_received(self, msg: can.Message) -> None:
        """Log one message."""
        bus = "" if msg.channel is None else str(msg.channel)
        waiting = self._waiting.get(bus)
        if waiting is None:
            waiting = self._waiting[bus] = _Waiting(bus)
        waiting.add(msg)
        if waiting.full:
            self._log(waiting.take())
        if time.monotonic() - self._flushed_at > _FLUSH_INTERVAL:
            self._flush()

    def file_size(self) -> int:
        """Bytes written, as far as known before compression."""
        return self._segment.size

    def stop(self) -> None:
        """Finish the file."""
        if not self._stopped:
            self._stopped = True
            self._flush(finish=True)

    def _log(self, contents: Iterator[dict[str, Any]]) -> None:
        for content in contents:
            self._segment.add(FRAMES.encode(content, content["first_ns"]))

    def _flush(self, finish: bool = False) -> None:
        for waiting in self._waiting.values():
            self._log(waiting.take())
            self._log(waiting.batcher.flush())
        if finish:
            self._segment.finish()
        else:
            self._segment.commit()
        self._flushed_at = time.monotonic()


class _Waiting:
    """Messages of one bus that are not yet in a batch."""

    def __init__(self, bus: str):
        self.batcher = Batcher(bus)
        self._frames = raw.empty(MAX_COUNT)
        self._count = 0

    @property
    def full(self) -> bool:
        return self._count == MAX_COUNT

    def add(self, msg: can.Message) -> None:
        fill(self._frames[self._count], msg)
        self._count += 1

    def take(self) -> Iterator[dict[str, Any]]:
        yield from self.batcher.add(self._frames[: self._count])
        self._frames["data"] = 0
        self._count = 0
