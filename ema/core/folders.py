"""Folders for what a command writes."""

from __future__ import annotations

from pathlib import Path

from .errors import ConfigError


def make_folder(path: Path) -> None:
    """Make a folder, and those above it, unless it is there; ConfigError when it cannot be made."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be made ({error.strerror})") from error
