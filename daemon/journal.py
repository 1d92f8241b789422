"""Lines for the service's journal with fields of their own, such as MESSAGE_ID; elsewhere they are lines on stderr.

The native protocol of systemd-journald: one datagram of FIELD=value lines (https://systemd.io/JOURNAL_NATIVE_PROTOCOL).
"""

from __future__ import annotations

import logging
import os
import socket
import sys
from contextlib import suppress
from pathlib import Path

SOCKET = Path("/run/systemd/journal/socket")
_PRIORITY = {logging.DEBUG: 7, logging.INFO: 6, logging.WARNING: 4, logging.ERROR: 3, logging.CRITICAL: 2}


class JournalHandler(logging.Handler):
    """Sends records to the journal; fields come from ``extra={"journal": {...}}``. Never waits, never raises."""

    def __init__(self, address: Path = SOCKET):
        super().__init__()
        self._address = str(address)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)

    def emit(self, record: logging.LogRecord) -> None:
        """See logging.Handler."""
        text = " ".join(self.format(record).splitlines())
        fields = {"MESSAGE": text, "PRIORITY": _PRIORITY.get(record.levelno, 5), "SYSLOG_IDENTIFIER": "ema"}
        lines = (f"{name}={value}\n" for name, value in {**fields, **getattr(record, "journal", {})}.items())
        with suppress(OSError):
            self._socket.sendto("".join(lines).encode(), self._address)

    def close(self) -> None:
        """See logging.Handler."""
        self._socket.close()
        super().close()


def use_journal() -> None:
    """Where stderr is the journal (systemd says so in JOURNAL_STREAM), talk to it natively."""
    device, _, inode = os.environ.get("JOURNAL_STREAM", "").partition(":")
    with suppress(OSError, ValueError):
        stat = os.fstat(sys.stderr.fileno())
        if (stat.st_dev, stat.st_ino) == (int(device), int(inode)) and SOCKET.exists():
            logging.getLogger().handlers[:] = [JournalHandler()]
