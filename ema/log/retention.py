"""Which segments of a log directory are kept."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

# A prefix, UTC to the millisecond, a running number. The number tells the order: a clock may be set.
_NAME = re.compile(r"\d{8}T\d{9}Z-(\d{4,})\.mcap")


def is_segment(path: Path, prefix: str) -> bool:
    """Whether a file is one of the writer's own segments, by its name."""
    return path.name.startswith(prefix + "-") and _NAME.fullmatch(path.name[len(prefix) + 1 :]) is not None


def number(path: Path) -> int:
    """The running number in a segment's name."""
    return int(path.stem.rpartition("-")[2])


def segments(directory: Path, prefix: str) -> list[Path]:
    """The writer's own segments in the order of their numbers; other files in the directory are left alone."""
    own = (path for path in directory.iterdir() if is_segment(path, prefix))
    return sorted(own, key=lambda path: (number(path), path.name))


def newest(path: Path) -> Path | None:
    """The segment of the highest number beside a segment and of its kind; None where the file is no segment."""
    prefix = path.name.rsplit("-", 2)[0]
    return segments(path.parent, prefix)[-1] if is_segment(path, prefix) else None


def next_number(directory: Path, prefix: str) -> int:
    """Greater than that of every segment there is, whichever run wrote it."""
    return max(map(number, segments(directory, prefix)), default=0) + 1


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
    keep_least: int,
    free_space: Callable[[Path], int] = free_space,
) -> list[Path]:
    """Delete the segments of the lowest numbers beyond a count, and while less than `keep_free` [B] is free.

    `current` and the `keep_least` segments of the highest numbers are never deleted: a disk filled by others stops the
    log, it does not eat it. Returns what was deleted.
    """
    old = [path for path in segments(directory, prefix) if path != current]
    deleted = []
    while len(old) + 1 > keep_least and (len(old) + 1 > keep_segments or free_space(directory) < keep_free):
        path = old.pop(0)
        path.unlink(missing_ok=True)
        deleted.append(path)
    return deleted
