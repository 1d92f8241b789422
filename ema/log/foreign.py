"""Raw logs of other tools, by python-can: candump, asc, blf, csv, trc, mf4, db."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ema.core import frames as raw
from ema.core.can_messages import fill
from ema.core.closing import Closing
from ema.core.errors import LogError

from .reader import FrameBatch, Paths, find_logs

SUFFIXES = (".asc", ".blf", ".csv", ".db", ".log", ".mf4", ".trc")
_NO_FRAMES = "a CSV log has a row timestamp,arbitration_id,extended,remote,error,dlc,data for each frame"
_BATCH = 512


class ForeignLog(Closing):
    """Frames of logs that are not ours, as `reader.LogReader.frames` gives them.

    Raises
    ------
    LogError
        A file is missing, of an unknown kind, or damaged (while reading).
    """

    def __init__(self, paths: Paths, start_ns: int | None = None, end_ns: int | None = None):
        self.paths = find_logs(paths, SUFFIXES)
        self.start_ns, self.end_ns = start_ns, end_ns
        for path in self.paths:
            if _suffix(path) not in SUFFIXES:
                raise LogError(f"{path}: is no kind of log known here ({', '.join(('.mcap', *SUFFIXES))})")

    def close(self) -> None:
        """Nothing is held open between reads."""

    def first_ns(self) -> int | None:
        """Time of the first frame, None without one. [ns]"""
        for batch in self._read(self.paths[0]):
            return int(batch.frames["t_ns"][0])
        return None

    def frames(self) -> Iterator[FrameBatch]:
        """Raw frames in the order of the files."""
        for path in self.paths:
            for bus, frames in self._read(path):
                low = 0 if self.start_ns is None else self.start_ns
                high = 2**64 - 1 if self.end_ns is None else self.end_ns
                chosen = frames[(frames["t_ns"] >= low) & (frames["t_ns"] < high)]
                if len(chosen):
                    yield FrameBatch(bus, chosen)

    def _read(self, path: Path) -> Iterator[FrameBatch]:
        batch = raw.empty(_BATCH)
        count, bus = 0, ""
        for message in _messages(path):
            name = "" if message.channel is None else str(message.channel)
            if count == _BATCH or (count and name != bus):
                yield FrameBatch(bus, batch[:count])
                batch, count = raw.empty(_BATCH), 0
            bus = name
            try:
                fill(batch[count], message)
            except ValueError as error:
                raise LogError(f"{path}: {error}") from error
            count += 1
        if count:
            yield FrameBatch(bus, batch[:count])


def _suffix(path: Path) -> str:
    suffixes = [suffix.lower() for suffix in path.suffixes]
    return suffixes[-2] if len(suffixes) > 1 and suffixes[-1] == ".gz" else (suffixes or [""])[-1]


def _messages(path: Path) -> Iterator[Any]:
    import can

    try:
        with can.LogReader(path) as log:
            yield from log
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (NotImplementedError, ImportError) as error:
        raise LogError(f"{path}: needs a package that is not installed ({error}); try ema-monitor[analyse]") from error
    except Exception as error:  # parsers of text and binary formats let anything through on a damaged file
        why = _NO_FRAMES if _suffix(path) == ".csv" else f"{type(error).__name__}: {error}"
        raise LogError(f"{path}: is damaged or not what its name says ({why})") from error
