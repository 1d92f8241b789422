"""What a file must be before it is opened: a device never ends, a pipe may never begin, and what exists stays."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

from .errors import ConfigError

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def require_file(path: str | Path, most: int | None = None) -> Path:
    """The path of a regular file of at most `most` bytes; OSError, with what it is instead as `strerror`, otherwise."""
    path = Path(path)
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        kind = _KINDS.get(stat.S_IFMT(status.st_mode), "something else")
        raise OSError(errno.EINVAL, f"it is {kind}, a file is wanted", str(path))
    if most is not None and status.st_size > most:
        raise OSError(errno.EFBIG, f"it has {status.st_size} bytes, at most {most} make sense", str(path))
    return path


def require_new(path: Path, otherwise: str = "choose another --out") -> Path:
    """The path of a file that does not exist yet; ConfigError, with what to do `otherwise`, where one does."""
    if path.exists():
        raise ConfigError(f"{path}: exists, and is not overwritten; {otherwise}")
    return path


def write_new(path: Path, text: str, otherwise: str = "choose another --out") -> None:
    """Write a file that must not exist yet; ConfigError where it does or cannot be written."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        require_new(path, otherwise)
        raise
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written ({error.strerror})") from error
