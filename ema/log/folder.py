"""One writer for one folder: a lock on the folder itself, which leaves no file and ends with the process."""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import weakref
from pathlib import Path

_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL)  # some network file systems
_logger = logging.getLogger("ema.log")


class FolderLock:
    """Keeps every other writer out of a folder, until it is released or the process ends.

    Parameters
    ----------
    directory : Path
    """

    def __init__(self, directory: Path):
        self._directory = directory
        self._close: weakref.finalize | None = None
        self._held: tuple[int, int] | None = None

    def hold(self) -> None:
        """Take the lock, again where the folder has been made anew.

        Raises
        ------
        OSError
            Another writer has the folder (EBUSY), or it cannot be opened.
        """
        status = self._directory.stat()
        if self._held == (status.st_dev, status.st_ino):
            return
        self.release()
        descriptor = os.open(self._directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        close = weakref.finalize(self, os.close, descriptor)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            close()
            raise OSError(errno.EBUSY, "another monitor is writing there: give each its own") from error
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                close()
                raise
            _logger.warning("log directory %s cannot be locked (%s)", self._directory, error.strerror)
        self._close, self._held = close, (status.st_dev, status.st_ino)

    def release(self) -> None:
        """Give the lock back."""
        if self._close is not None:
            self._close()
        self._close = self._held = None


def is_held(directory: Path) -> bool:
    """Whether a writer has the folder now."""
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False
