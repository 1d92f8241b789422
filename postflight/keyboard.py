"""Single keys from a terminal, which is left as it was."""

from __future__ import annotations

import os
import select
import sys
from typing import Any

from ema.core.closing import Closing


class Keyboard(Closing):
    """Keys pressed on standard input; none where that is no terminal."""

    def __init__(self) -> None:
        self._fd: int | None = None
        self._before: list[Any] = []
        try:
            import termios
            import tty

            if sys.stdin.isatty():
                self._fd = sys.stdin.fileno()
                self._before = termios.tcgetattr(self._fd)
                tty.setcbreak(self._fd)
        except (ImportError, OSError, ValueError):
            self._fd = None

    def pressed(self) -> str:
        """The keys since the last call; of those that send several characters nothing."""
        if self._fd is None or not select.select([self._fd], [], [], 0)[0]:
            return ""
        keys = os.read(self._fd, 64).decode(errors="ignore")
        return "" if "\x1b" in keys else keys

    def close(self) -> None:
        """Give the terminal back."""
        if self._fd is not None:
            import termios

            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._before)
            self._fd = None
