"""Where progress and tables are printed: on a terminal as wide as it is, into a pipe or file without breaking lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

UNBROKEN = 1000  # characters; rich would take a pipe for a terminal of 80


def console(*, stderr: bool = False) -> Console:
    """A console of rich on standard output or error."""
    from rich.console import Console

    made = Console(stderr=stderr)
    if not made.is_terminal:
        made.width = UNBROKEN
    return made
