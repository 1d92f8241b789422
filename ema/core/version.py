"""Which software this is: the release and, in a checkout or a wheel made from one, the commit: ``0.1.0+g25b3386e6``."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

RELEASE = "0.1.0"
ROOT = Path(__file__).parents[2]


@cache
def version() -> str:
    """Version of the running code; ``.dirty`` where files differ from the commit.

    A build asks too (`pyproject.toml`), and what it writes down is what an installed wheel says.
    """
    if (ROOT / "pyproject.toml").exists():
        return RELEASE + _commit() if (ROOT / ".git").exists() else _of_source()
    return metadata.version("ema-monitor")


def _commit() -> str:
    """Local part of the version; empty where git does not tell."""
    ask = ("git", "-C", str(ROOT), "describe", "--always", "--dirty=.dirty", "--abbrev=9", "--exclude=*")
    try:
        said = subprocess.run(ask, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
    return f"+g{said}" if said else ""


def _of_source() -> str:
    """Version of a source distribution: what was written into it when it was made."""
    try:
        facts = (ROOT / "PKG-INFO").read_text(encoding="utf-8")
    except OSError:
        return RELEASE
    return next((line.split()[1] for line in facts.splitlines() if line.startswith("Version: ")), RELEASE)
