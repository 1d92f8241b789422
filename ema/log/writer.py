"""The log as the daemon sees it: calls return at once, a thread of its own writes and waits for the disk."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ema.core.closing import Closing
from ema.core.errors import LogError
from ema.core.status import LogState

from . import schemas
from .segmented import SegmentedLog
from .settings import LogSettings

_BACKLOG_LIMIT = 32_000_000  # bytes waiting for the thread; beyond, messages are dropped and counted
_PATIENCE = 2.0  # for a device to take what has come since it was written to last [s]
_logger = logging.getLogger("ema.log")


class LogWriter(Closing):
    """Writes frames, estimates, envelopes, events and status to MCAP segments.

    Contents are the dictionaries described in `ema.log.schemas`; numpy values and NaN (→ null) are accepted.

    Parameters
    ----------
    directory : path
        Must exist and be writable.
    attachments : mapping of name to bytes or path
        Stored in every segment: the DBC, the configuration, the bundle's manifest.
    settings : LogSettings
    metadata : mapping
        Further key-value pairs, for example versions.

    Raises
    ------
    LogError
        The directory is missing or cannot be written, or an attachment cannot be read.

    Examples
    --------
    >>> with LogWriter("/var/log/ema", {"ema.dbc": dbc_path}) as log:
    ...     log.frames(batch, "vcan0")
    """

    def __init__(
        self,
        directory: str | Path,
        attachments: Mapping[str, bytes | Path] | None = None,
        settings: LogSettings | None = None,
        *,
        metadata: Mapping[str, str] | None = None,
        prefix: str = "ema",
    ):
        loaded = {name: _load(name, data) for name, data in (attachments or {}).items()}
        self._log = SegmentedLog(
            Path(directory),
            loaded,
            settings or LogSettings(),
            time.time_ns(),
            time.monotonic(),
            prefix=prefix,
            metadata=metadata,
        )
        self._queue: deque[Callable[[], None]] = deque()
        self._wake = threading.Condition()
        self._backlog = 0
        self._overflow = 0
        self._stopping = False
        self._broken = False
        self._working_since: float | None = None  # monotonic [s]
        self._free = self._log.free_bytes
        self._thread = threading.Thread(target=self._run, name="ema-log", daemon=True)
        self._thread.start()

    @property
    def state(self) -> LogState:
        """OK, FULL or FAILED."""
        return LogState.FAILED if self._broken else self._log.state

    @property
    def hangs(self) -> bool:
        """Whether the device has not taken what it was given for so long that nothing is known to be written."""
        since = self._working_since
        return since is not None and time.monotonic() - since > _PATIENCE

    @property
    def dropped(self) -> int:
        """Frames and messages not logged since the start."""
        return self._log.dropped + self._overflow

    @property
    def free_bytes(self) -> int:
        """Free space of the log's file system at the last flush. [B]"""
        return self._free

    @property
    def path(self) -> Path | None:
        """The segment being written."""
        return self._log.path

    def frames(self, batch: np.ndarray, bus: str) -> None:
        """Log raw frames, shape (n,), FRAME_DTYPE; the array may be reused at once."""
        if len(batch):
            copy = batch.copy()
            self._put(copy.nbytes, len(copy), lambda: self._log.frames(copy, bus))

    def estimate(self, content: dict[str, Any]) -> None:
        """Log one estimate (`schemas.ESTIMATE`)."""
        self._message(schemas.ESTIMATE, content)

    def nuisance(self, content: dict[str, Any]) -> None:
        """Log one parameter estimated beside the faults (`schemas.NUISANCE`)."""
        self._message(schemas.NUISANCE, content)

    def envelope(self, content: dict[str, Any]) -> None:
        """Log one envelope at the schedule (`schemas.ENVELOPE`)."""
        self._message(schemas.ENVELOPE, content)

    def event(self, content: dict[str, Any]) -> None:
        """Log one event (`schemas.EVENT`)."""
        self._message(schemas.EVENT, content)

    def alarm(self, content: dict[str, Any]) -> None:
        """Log a change of an alarm (`schemas.ALARM`)."""
        self._message(schemas.ALARM, content)

    def alarm_state(self, content: dict[str, Any]) -> None:
        """Log what the alarms go on from (`schemas.ALARM_STATE`)."""
        self._message(schemas.ALARM_STATE, content)

    def status(self, content: dict[str, Any]) -> None:
        """Log a copy of the heartbeat (`schemas.STATUS`)."""
        self._message(schemas.STATUS, content)

    def cut(self, settings: LogSettings | None = None, attachments: Mapping[str, bytes] | None = None) -> None:
        """Begin a new segment within a flush interval, from there on with these settings and changed attachments."""
        self._put(0, 0, lambda: self._log.cut(settings, attachments))

    def close(self) -> None:
        """Write what waits and finish the segment. LogError when the device does not take it."""
        if self._stopping:
            return
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join()
        self._log.close()

    def _message(self, kind: schemas.Kind, content: dict[str, Any]) -> None:
        message = kind.encode(content)  # here, so that the caller may go on changing the content
        self._put(len(message.data), 1, lambda: self._log.write(message))

    def _put(self, size: int, count: int, job: Callable[[], None]) -> None:
        with self._wake:
            if self._backlog + size > _BACKLOG_LIMIT or self._broken or self._stopping:
                self._overflow += count
                return
            self._backlog += size
            self._queue.append(job)
            if self._backlog > _BACKLOG_LIMIT // 2:
                self._wake.notify()

    def _run(self) -> None:
        try:
            while self._step():
                pass
        except Exception:  # a defect here must not stop the monitor: it goes on without a log, and says so
            _logger.exception("the log has failed")
            self._broken = True

    def _step(self) -> bool:
        with self._wake:
            if not self._stopping:
                self._wake.wait(self._log.settings.flush_interval / 2)
            jobs = list(self._queue)
            self._queue.clear()
            self._backlog = 0
            stopping = self._stopping
        self._working_since = time.monotonic()
        for job in jobs:
            job()
        self._log.tick(time.time_ns(), time.monotonic())
        self._free = self._log.free_bytes
        self._working_since = None
        return not stopping


def _load(name: str, data: bytes | Path) -> bytes:
    if isinstance(data, bytes):
        return data
    try:
        return data.read_bytes()
    except OSError as error:
        raise LogError(f"attachment {name}: {data} cannot be read ({error.strerror})") from error
