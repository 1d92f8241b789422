"""Session numbers that are never used twice, whatever the clock says: from a file, a block of them with each start."""

from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path

from ema.core.errors import BusError

LARGEST = (1 << 32) - 1
_YEARS = 1 << 28  # a clock so far ahead is not followed: numbers would run out [s]
BLOCK = 64  # numbers taken from the file at once, so that a stranger's challenges do not wear the storage out


class Sessions:
    """Session numbers of what one process sends; each larger than all before.

    The file holds the next number that nobody has. It is written, and is on the disk, before a number out of it is
    used, so a crash loses numbers and never repeats one; several processes may share it. Numbers are no smaller than
    the seconds since 1970: should a file be lost, or another machine take over, they most likely still increase. A
    clock that is wrong costs no more than that.

    Parameters
    ----------
    path : Path
        BusError when it cannot be kept.
    """

    def __init__(self, path: Path):
        self._path = path
        self._next = self._end = 0
        self._reserve()

    def take(self) -> int:
        """A number of a new session."""
        if self._next == self._end or 0 < int(time.time()) - self._end < _YEARS:
            self._reserve()
        self._next += 1
        return self._next - 1

    def _reserve(self) -> None:
        try:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(file, fcntl.LOCK_EX)
                first = self._first(os.pread(file, 32, 0))
                os.pwrite(
                    file, f"{first + BLOCK:010d}\n".encode(), 0
                )  # of one length, so that no rest of another stays
                os.fsync(file)
            finally:
                os.close(file)
        except OSError as error:
            raise BusError(f"session file {self._path}: cannot be kept ({error.strerror})") from error
        self._next, self._end = first, first + BLOCK

    def _first(self, text: bytes) -> int:
        now = int(time.time())
        if not text:
            return now
        if not text.strip().isdigit() or int(text) > LARGEST - BLOCK:
            raise BusError(
                f"session file {self._path}: is damaged; write a number into it that is larger than any session so far"
            )
        return max(int(text), now) if now - int(text) < _YEARS else int(text)
