"""Which segments of a log directory are kept."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

# A prefix, UTC to the millisecond, a running number: sorts by time.
_NAME = re.compile(r"\d{8}T\d{9}Z-\d{4,}\.mcap")


def is_segment(path: Path, prefix: str) -> bool:
    """Whether a file is one of the writer's own segments, by its name."""
    return path.name.startswith(prefix + "-") and _NAME.fullmatch(path.name[len(prefix) + 1 :]) is not None


def segments(directory: Path, prefix: str) -> list[Path]:
    """The writer's own segments, oldest first; other files in the directory are left alone."""
    return sorted(path for path in directory.iterdir() if is_segment(path, prefix))


def free_space(directory: Path) -> int:
    """Room that an unprivileged process may still use. [B]"""
    stat = os.statvfs(directory)
    return stat.f_bavail * stat.f_frsize


def prune(
    directory: Path,
    prefix: str,
    current: Path | None,
    keep_segments: int,
    keep_free: int,
    free_space: Callable[[Path], int] = free_space,
) -> list[Path]:
    """Delete the oldest segments beyond a count, and while there is less free space than `keep_free`. [B]

    `current` is never deleted. Returns what was deleted.
    """
    old = [path for path in segments(directory, prefix) if path != current]
    deleted = []
    while old and (len(old) + 1 > keep_segments or free_space(directory) < keep_free):
        path = old.pop(0)
        path.unlink(missing_ok=True)
        deleted.append(path)
    return deleted
