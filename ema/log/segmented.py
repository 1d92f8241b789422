"""A log of segments in a directory: cut by size and time, flushed in time, pruned, and patient with a full disk.

Synchronous and without a clock of its own: the caller hands in the time. `writer.LogWriter` runs it in a thread.
"""

from __future__ import annotations

import errno
import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ema.core.errors import LogError
from ema.core.status import LogState
from ema.core.version import version

from . import contents, retention, schemas
from .batches import Batcher
from .folder import FolderLock
from .schemas import Encoded
from .segment import BEFORE_KEY, Segment
from .settings import LogSettings

_MB = 1_000_000
_PENDING_LIMIT = 8 * _MB  # committed before the flush interval is over; kept of what a full disk refuses
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_logger = logging.getLogger("ema.log")


class SegmentedLog:
    """Writes messages to segments `PREFIX-TIME-NUMBER.mcap` of a directory.

    While the disk is full, up to 8 MB (compressed) are kept and written when there is room. Beyond that, and while the
    device fails altogether, messages are dropped and counted. Every flush interval a new attempt is made.

    Parameters
    ----------
    directory : Path
        Must exist and be writable.
    attachments : mapping of name to bytes
        Stored in every segment.
    settings : LogSettings
    t_ns, clock : int, float
        Wall-clock time, for names and messages [ns], and monotonic time, for intervals [s].
    free_space : callable
        Free space of a directory. [B]

    Raises
    ------
    LogError
        The directory is missing or cannot be written.
    """

    def __init__(
        self,
        directory: Path,
        attachments: Mapping[str, bytes],
        settings: LogSettings,
        t_ns: int,
        clock: float,
        *,
        prefix: str = "ema",
        metadata: Mapping[str, str] | None = None,
        free_space: Callable[[Path], int] = retention.free_space,
    ):
        self.state = LogState.OK
        self.dropped = 0
        self.directory, self.settings = directory, settings
        self._prefix, self._attachments, self._metadata = prefix, dict(attachments), dict(metadata or {})
        self._free_space = free_space
        self._batchers: dict[str, Batcher] = {}
        self._segment: Segment | None = None
        self._number = 0
        self._cut = False
        self._lock = FolderLock(directory)
        self._opened_at = self._flushed_at = self._troubled_at = clock
        self._dropped_before = 0
        if not directory.is_dir():
            raise LogError(f"log directory {directory} does not exist: create it, or name another one")
        try:
            self._open(t_ns, clock)
        except OSError as error:
            if error.errno not in _NO_ROOM:
                self._lock.release()
                raise LogError(f"log directory {directory} cannot be written ({error.strerror})") from error
            self._trouble(error, clock)

    @property
    def path(self) -> Path | None:
        """The segment being written."""
        return self._segment.path if self._segment else None

    @property
    def free_bytes(self) -> int:
        """Free space of the directory's file system, 0 when it cannot be asked. [B]"""
        try:
            return self._free_space(self.directory)
        except OSError:
            return 0

    def write(self, message: Encoded) -> None:
        """Accept one message, or drop and count it while the device refuses writes."""
        segment = self._open_segment()
        if segment is None:
            self.dropped += 1
        else:
            segment.add(message)

    def frames(self, batch: np.ndarray, bus: str) -> None:
        """Accept frames of one bus, shape (n,), FRAME_DTYPE."""
        segment = self._open_segment()
        if segment is None:
            self.dropped += len(batch)
            return
        batcher = self._batchers.setdefault(bus, Batcher(bus))
        for content in batcher.add(batch):
            segment.add(schemas.FRAMES.encode(content, content["first_ns"]))

    def tick(self, t_ns: int, clock: float) -> None:
        """Flush, rotate, prune and retry as far as due: at half the interval, so that the writing fits into it."""
        pending = self._segment.pending if self._segment else 0
        if clock - self._flushed_at < self.settings.flush_interval / 2 and pending < _PENDING_LIMIT:
            return
        self._flushed_at = clock
        try:
            self._flush(t_ns, clock)
        except OSError as error:
            self._trouble(error, clock)
        else:
            if self.state is not LogState.OK:
                self._recovered(t_ns, clock)

    def cut(self, settings: LogSettings | None = None, attachments: Mapping[str, bytes] | None = None) -> None:
        """Have the next flush begin a new segment, with other settings and attachments where they are given."""
        self.settings = settings or self.settings
        self._attachments |= attachments or {}
        self._cut = True
        if self._segment is not None:
            self._collect_frames(self._segment)  # what is written from here on comes behind them

    def close(self) -> None:
        """Finish the current segment. LogError when the device does not take it; the file is readable all the same."""
        segment, self._segment = self._segment, None
        try:
            if segment is not None:
                self._collect_frames(segment)
                segment.finish()
        except OSError as error:
            if segment is not None:
                segment.abandon()
                raise LogError(f"{segment.path}: could not be finished ({error.strerror})") from error
        finally:
            self._lock.release()

    def _open_segment(self) -> Segment | None:
        """The segment that takes messages now; None where they must be dropped."""
        segment = self._segment
        if segment is None or segment.finishing:
            return None
        return segment if self.state is LogState.OK or segment.pending < _PENDING_LIMIT else None

    def _flush(self, t_ns: int, clock: float) -> None:
        keep_free = int(self.settings.keep_free * _MB)
        segment = self._segment
        if segment is not None and not segment.path.exists():
            _logger.warning("segment %s was deleted under the log", segment.path)
            self._drop_segment()
        for path in retention.prune(
            self.directory,
            self._prefix,
            self.path,
            self.settings.keep_segments,
            keep_free,
            self.settings.keep_least,
            self._free_space,
        ):
            _logger.info("deleted old segment %s", path)
        if self._free_space(self.directory) < keep_free:
            raise OSError(errno.ENOSPC, f"less than {self.settings.keep_free:g} MB left")
        if self._segment is not None:
            self._collect_frames(self._segment)
            self._segment.commit()
            if self._is_due(self._segment, clock):
                self._segment.finish()
                self._segment = None
        if self._segment is None:
            self._open(t_ns, clock)

    def _is_due(self, segment: Segment, clock: float) -> bool:
        aged = clock - self._opened_at >= self.settings.segment_time
        return self._cut or segment.finishing or aged or segment.size >= self.settings.segment_size * _MB

    def _open(self, t_ns: int, clock: float) -> None:
        self._lock.hold()
        self._number = max(self._number + 1, retention.next_number(self.directory, self._prefix))
        moment = datetime.fromtimestamp(t_ns / 1e9, UTC)
        name = f"{self._prefix}-{moment:%Y%m%dT%H%M%S}{moment.microsecond // 1000:03d}Z-{self._number:04d}.mcap"
        metadata = {"software": version(), **self._metadata, "segment": str(self._number)}
        before = retention.segments(self.directory, self._prefix)
        if before:
            metadata[BEFORE_KEY] = before[-1].name
        self._segment = Segment(self.directory / name, t_ns, self._attachments, metadata)
        self._opened_at, self._cut = clock, False

    def _collect_frames(self, segment: Segment) -> None:
        if segment.finishing:
            return
        for batcher in self._batchers.values():
            for content in batcher.flush():
                segment.add(schemas.FRAMES.encode(content, content["first_ns"]))

    def _trouble(self, error: OSError, clock: float) -> None:
        state = LogState.FULL if error.errno in _NO_ROOM else LogState.FAILED
        if self.state is LogState.OK:
            self._troubled_at, self._dropped_before = clock, self.dropped
        if self.state is not state:
            _logger.error("log in %s stopped: %s; trying again until it works", self.directory, error.strerror)
        self.state = state
        if state is LogState.FAILED and self._segment is not None:
            self._drop_segment()

    def _drop_segment(self) -> None:
        if self._segment is not None:
            self._segment.abandon()
        self._segment = None

    def _recovered(self, t_ns: int, clock: float) -> None:
        was, self.state = self.state, LogState.OK
        lost = self.dropped - self._dropped_before
        text = f"log was {was.name.lower()} for {clock - self._troubled_at:.1f} s, {lost} frames and messages dropped"
        _logger.warning("%s", text)
        self.write(schemas.EVENT.encode(contents.event(t_ns, "warning", "log_resumed", text)))
