"""Ending a program by the user or the service manager."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable


def on_stop(stop: Callable[[], object]) -> None:
    """Call `stop` on SIGTERM and SIGINT. Outside the main thread, which alone gets signals, do nothing."""
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop())
