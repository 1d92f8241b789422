"""Ending a program by the user or the service manager."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def on_stop(stop: Callable[[], object]) -> None:
    """Call `stop` on SIGTERM and SIGINT. Outside the main thread, which alone gets signals, do nothing."""
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop())


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """A SIGTERM, as `timeout` and job schedulers send it, is a Ctrl-C: what is known by then is written."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
