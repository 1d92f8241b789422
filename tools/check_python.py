"""Say in one line when this Python is too old for the project."""

import sys

if sys.version_info < (3, 11):
    sys.exit(
        f"ema needs Python 3.11 or newer; {sys.executable} is {sys.version.split()[0]}. Try: make PYTHON=python3.11"
    )
