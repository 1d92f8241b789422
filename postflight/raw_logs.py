"""Raw frames into the log format of another tool, read back before the file is there: never fewer in silence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ema.core import frames as raw
from ema.core.errors import LogError
from ema.core.frames import FrameFlag
from ema.log import LogReader
from ema.log.foreign import ForeignLog
from ema.log.reader import FrameBatch

from .open_log import names

# What a frame is. Its direction and the channel's name are not: most formats have numbers for channels.
_KIND = int(FrameFlag.EXTENDED | FrameFlag.REMOTE | FrameFlag.ERROR | FrameFlag.FD | FrameFlag.BRS | FrameFlag.ESI)
_MORE = ".blf, .mf4 or .mcap"  # hold every frame there is


def write_frames(log: LogReader | ForeignLog, out: Path) -> int:
    """Write all frames of a log to a new file of another tool; the number of frames.

    Raises
    ------
    LogError
        The file exists, cannot be written, or does not hold every frame as it was.
    """
    if out.exists():
        raise LogError(f"{out}: exists, and is not overwritten")
    if next(log.frames(), None) is None:
        raise LogError(f"{names(log.paths)}: no frame in it")
    unfinished = out.with_name(f".unfinished-{out.name}")
    unfinished.unlink(missing_ok=True)
    try:
        count = _write(log, unfinished, out)
        _compare(log, unfinished, out)
        out.hardlink_to(unfinished)  # fails where another process made the file meanwhile
    except OSError as error:
        raise LogError(f"{out}: cannot be written ({error.strerror or error})") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return count


def _write(log: LogReader | ForeignLog, path: Path, out: Path) -> int:
    import logging

    import can

    from ema.core.can_messages import message

    count = 0
    logging.getLogger("can").setLevel(logging.ERROR)  # a warning for each frame that it leaves out: counted here
    try:
        with can.Logger(path) as target:
            for bus, frames in log.frames():
                for frame in frames:
                    target(message(frame, bus or None))
                count += len(frames)
    except (ValueError, NotImplementedError, ImportError) as error:
        raise LogError(f"{out}: {error}") from error
    return count


def _compare(log: LogReader | ForeignLog, path: Path, out: Path) -> None:
    """LogError where the file does not hold what was written to it."""
    with LogReader(path) if path.suffix.lower() == ".mcap" else ForeignLog(path) as back:
        try:
            held = _rows(back.frames())
            at = 0
            for _, frames in log.frames():
                found = _take(held, len(frames))
                n = min(len(found), len(frames))
                wrong = np.flatnonzero(_different(frames[:n], found[:n]))
                if len(wrong) or n < len(frames):
                    first = int(wrong[0]) if len(wrong) else n
                    raise LogError(f"{out}: cannot hold {_words(frames[first])} (frame {at + first}); choose {_MORE}")
                at += n
            if len(_take(held, 1)):
                raise LogError(f"{out}: holds more frames than were written to it")
        except LogError as error:
            raise LogError(str(error).replace(str(path), str(out))) from error


class _Rows:
    """Frames of batches, taken in parts of any length."""

    def __init__(self, batches: Iterator[FrameBatch]):
        self.batches = batches
        self.rest = raw.empty(0)


def _rows(batches: Iterable[FrameBatch]) -> _Rows:
    return _Rows(iter(batches))


def _take(rows: _Rows, count: int) -> np.ndarray:
    parts = [rows.rest]
    while sum(map(len, parts)) < count and (batch := next(rows.batches, None)) is not None:
        parts.append(batch.frames)
    together = np.concatenate(parts)
    rows.rest = together[count:]
    return together[:count]


def _different(written: np.ndarray, read: np.ndarray) -> np.ndarray:
    """Which frames are not the same in kind, identifier and data."""
    differs: np.ndarray = (written["id"] != read["id"]) | (written["length"] != read["length"])
    differs |= _kind(written) != _kind(read)
    inside = np.arange(raw.MAX_DATA) < written["length"][:, None]
    data = inside & ((written["flags"] & FrameFlag.REMOTE) == 0)[:, None]
    return differs | (data & (written["data"] != read["data"])).any(axis=1)


def _kind(frames: np.ndarray) -> np.ndarray:
    """Kind by its flags; a refused frame is an error frame for others."""
    refused = np.where(frames["flags"] & FrameFlag.REFUSED, int(FrameFlag.ERROR), 0)
    return np.asarray(refused | (frames["flags"] & _KIND))


def _words(frame: np.ndarray) -> str:
    flags = int(frame["flags"])
    if flags & (FrameFlag.ERROR | FrameFlag.REFUSED):
        return "error frames with what they say"
    if flags & FrameFlag.REMOTE:
        return "remote frames with their length"
    if flags & FrameFlag.FD:
        return "CAN FD frames"
    return f"a frame of {int(frame['length'])} bytes with identifier {int(frame['id']):X}"
