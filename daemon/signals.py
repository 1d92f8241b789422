"""What each signal does to the daemon; a table of it is in docs/daemon.md.

A handler only notes what is asked for: the loop does it at its next turn.
"""

from __future__ import annotations

import faulthandler
import signal
import sys
import threading
from collections.abc import Callable, Mapping

# No one sends these on purpose. Left alone, each would end the daemon without finishing its log.
IGNORED = (
    signal.SIGALRM,
    signal.SIGVTALRM,
    signal.SIGPROF,
    signal.SIGIO,
    signal.SIGSTKFLT,
    *range(signal.SIGRTMIN, signal.SIGRTMAX + 1),
)
STOPPING = (signal.SIGTERM, signal.SIGINT, signal.SIGPWR)  # the last one: power is failing


def decide(asked: Mapping[signal.Signals, Callable[[], object]]) -> None:
    """Install what signals ask for, and what the others do. Outside the main thread, which alone gets them, nothing.

    SIGQUIT writes the stacks of all threads to standard error, and the daemon goes on; a signal of a defect (SIGSEGV,
    SIGABRT of the watchdog …) does so before it ends the process.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number, ask in asked.items():
        signal.signal(number, lambda *_, ask=ask: ask())
    for number in set(IGNORED) - set(asked):
        signal.signal(number, signal.SIG_IGN)
    try:
        faulthandler.enable()
        faulthandler.register(signal.SIGQUIT, all_threads=True)
    except (ValueError, OSError, AttributeError):  # no standard error with a descriptor: no stacks, but it must not end
        signal.signal(signal.SIGQUIT, signal.SIG_IGN)
        print("no stacks on SIGQUIT: standard error has no descriptor", file=sys.stderr)
