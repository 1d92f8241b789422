"""One build at a time in a work folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ema.core.errors import BundleError


@contextmanager
def claimed(work: Path) -> Iterator[None]:
    """Make the folder and hold it for this process. The system releases it, however the process ends.

    Raises
    ------
    BundleError
        Another process holds it, or it cannot be made.
    """
    taken = BundleError(f"{work}: another build is at work here; wait until it is done or choose another --out")
    try:
        work.mkdir(parents=True, exist_ok=True)
        file = open(work / "lock", "ab")  # noqa: SIM115 - closed below, and not before the lock is to go
    except OSError as error:
        raise BundleError(f"{work}: cannot be written ({error.strerror})") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise taken from None
        if os.fstat(file.fileno()).st_nlink == 0:  # the other one has just removed its folder
            raise taken
        yield
