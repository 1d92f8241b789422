"""What the command `ema` runs first, so that Ctrl-C while all else is being loaded is one line, too."""

from __future__ import annotations

import sys


def main() -> None:
    """Load the command line and run it."""
    try:
        from .cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("ema: interrupted\n")
        sys.exit(130)
    run()
