"""Tell systemd how the service is (sd_notify); without systemd nothing happens."""

from __future__ import annotations

import os
import socket
from contextlib import suppress


def notify(state: str) -> None:
    """Send a state such as ``READY=1``, ``STOPPING=1`` or ``WATCHDOG=1``; never waits for who does not listen."""
    address = os.environ.get("NOTIFY_SOCKET")
    if address:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sock, suppress(OSError):
            sock.setblocking(False)
            sock.sendto(state.encode(), "\0" + address[1:] if address.startswith("@") else address)
