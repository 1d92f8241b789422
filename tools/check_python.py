"""Say in one line when this Python is too old for the project."""

import sys

if sys.version_info[:2] < (3, 11):  # noqa: UP036 - this file runs before anything is installed
    found = sys.version.split()[0]
    sys.exit(f"ema needs Python 3.11 or newer; {sys.executable} is {found}. Try: make PYTHON=python3.11")
