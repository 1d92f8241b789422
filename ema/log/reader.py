"""Logs read back: several segments as one, a time range, memory constant in the length of the log."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ema.core.closing import Closing
from ema.core.errors import LogError

from . import batches, schemas
from .copies import Copy, each_flight_once
from .folder import is_held
from .retention import newest
from .scan import Damage, McapFile, NotMcapError
from .segment import BEFORE_KEY

COPY_SUFFIX = ".recovered.mcap"
DAMAGE_KEY = "damage_of_the_original"  # in the metadata of a recovered copy
Paths = str | Path | Iterable[str | Path]


class Message(NamedTuple):
    """One message of a log."""

    topic: str
    t_ns: int
    content: dict[str, Any]


class FrameBatch(NamedTuple):
    """Frames of one bus, shape (n,), FRAME_DTYPE."""

    bus: str
    frames: np.ndarray


class LogReader(Closing):
    """Reads MCAP logs, unfinished and damaged ones included.

    Parameters
    ----------
    paths : path or paths
        Files or directories of files; read in the order of their first messages. Of copies of one flight, one. What is
        no MCAP file in a directory of others is damage, and so is an empty one among files that are named, as by a
        shell: a process that was killed may have left an empty segment.
    start_ns, end_ns : int, optional
        Only what happened in [start_ns, end_ns). [ns since the Unix epoch]

    Attributes
    ----------
    damage : list of Damage
        What could not be read so far (the first thousand); grows while reading.
    copies : list of Copy
        Files left out, since another one holds the same flight.

    Raises
    ------
    LogError
        A file is missing or unreadable; one that was named is not MCAP, or none of a directory is.
    """

    def __init__(
        self, paths: str | Path | Iterable[str | Path], start_ns: int | None = None, end_ns: int | None = None
    ):
        self.damage: list[Damage] = []
        self.start_ns, self.end_ns = start_ns, end_ns
        self._files: list[McapFile] = []
        self.copies: list[Copy] = []
        given = _listed(paths)
        try:
            self._open(find_logs(given, (".mcap",)), given)
            self._files, self.copies = self._each_once(self._files)
        except LogError:
            self.close()
            raise

    def close(self) -> None:
        """Close all files."""
        for file in self._files:
            file.close()

    def first_ns(self) -> int | None:
        """Time of the first message of all, None when there is none. [ns]"""
        times = (file.first_time() for file in self._files)
        return min((t for t in times if t is not None), default=None)

    @property
    def paths(self) -> list[Path]:
        """The files in the order they are read."""
        return [file.path for file in self._files]

    @property
    def unfinished(self) -> list[Path]:
        """Files that were not closed properly."""
        return [file.path for file in self._files if not file.finished]

    def complaints(self) -> list[str]:
        """What contradicts itself or may be missing, a line each; complete once everything has been read."""
        cut = (path for path in self.unfinished if not _is_live(path))
        return [*map(str, self.damage), *(f"{path}: was not finished: what came last may be missing" for path in cut)]

    def remarks(self) -> list[str]:
        """What else is to be known: a flight given twice, a log still written, a recovered copy, a segment missing."""
        live = [f"{path}: is still being written" for path in self.unfinished if _is_live(path)]
        copies, absent = [], []
        names = {file.path.name for file in self._files}
        for place, file in enumerate(self._files):
            said = file.metadata()
            if DAMAGE_KEY in said:
                source = said.get("recovered_from", "another log")
                copies.append(f"{file.path}: is a copy of {source}, in which was wrong: {said[DAMAGE_KEY]}")
            before = said.get(BEFORE_KEY)
            if place and before is not None and not {before, before.replace(".mcap", COPY_SUFFIX)} & names:
                absent.append(f"{file.path}: follows {before}, which is not among the files read")
        return [*map(str, self.copies), *live, *copies, *absent]

    def messages(self, wanted: Callable[[str], bool] = lambda topic: True) -> Iterator[Message]:
        """Messages on the wanted topics, without the raw frames, in the order they were written."""
        for entry in self.entries(lambda topic: topic != schemas.FRAMES.topic and wanted(topic)):
            if isinstance(entry, Message):
                yield entry

    def frames(self) -> Iterator[FrameBatch]:
        """Raw frames in the order they were written."""
        for entry in self.entries(lambda topic: topic == schemas.FRAMES.topic):
            if isinstance(entry, FrameBatch):
                yield entry

    def entries(self, wanted: Callable[[str], bool] = lambda topic: True) -> Iterator[Message | FrameBatch]:
        """Messages and raw frames as they were written."""
        low = 0 if self.start_ns is None else self.start_ns
        high = 2**63 if self.end_ns is None else self.end_ns
        # A batch is stored at the time of its first frame and holds others near it.
        early, late = max(0, low - batches.MAX_SPAN_NS), high + batches.MAX_SPAN_NS
        for file in self._files:
            for raw in file.messages(wanted, early, late):
                try:
                    content = json.loads(raw.data)
                    if raw.topic == schemas.FRAMES.topic:
                        frames = batches.unpack(content)
                        chosen = frames[(frames["t_ns"] >= low) & (frames["t_ns"] < high)]
                        if len(chosen):
                            yield FrameBatch(str(content.get("bus", "")), chosen)
                    elif low <= raw.t_ns < high:
                        yield Message(raw.topic, raw.t_ns, dict(content))
                except (ValueError, TypeError, RecursionError):
                    self._note(Damage(file.path, 0, f"a message on {raw.topic} cannot be read"))

    def attachments(self) -> dict[str, bytes]:
        """Attached files by name; of one that several segments hold, the first segment's."""
        found: dict[str, bytes] = {}
        for file in self._files:
            for attachment in file.attachments():
                found.setdefault(attachment.name, attachment.data)
        return found

    def metadata(self) -> dict[str, str]:
        """Key-value pairs of the first segment."""
        return self._files[0].metadata() if self._files else {}

    def _open(self, found: Sequence[Path], named: Sequence[Path]) -> None:
        refused: list[NotMcapError] = []
        for path in found:
            try:
                self._files.append(McapFile(path, self._note))
            except NotMcapError as error:
                if path in named and path.stat().st_size > 0:
                    raise
                refused.append(error)
                self._note(Damage(path, 0, error.what))
        if refused and not self._files:
            raise refused[0]
        self._files.sort(key=_order)

    def _each_once(self, files: list[McapFile]) -> tuple[list[McapFile], list[Copy]]:
        kept, copies = each_flight_once(files)
        for file in files:
            if file not in kept:
                file.close()
        left_out = {copy.path for copy in copies}
        self.damage = [damage for damage in self.damage if damage.path not in left_out]
        return kept, copies

    def _note(self, damage: Damage) -> None:
        if len(self.damage) < 1000 and damage not in self.damage:
            self.damage.append(damage)


def _order(file: McapFile) -> tuple[bool, int, str]:
    first_ns = file.first_time()
    return (first_ns is None, first_ns or 0, file.path.name)


def _is_live(path: Path) -> bool:
    """Whether a file is the newest segment of a folder that a daemon is writing."""
    return path == newest(path) and is_held(path.parent)


def _listed(paths: Paths) -> list[Path]:
    return [Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths]


def find_logs(paths: Paths, suffixes: tuple[str, ...]) -> list[Path]:
    """Files named, and files with one of the suffixes in directories named; LogError when there is none."""
    found: list[Path] = []
    for path in _listed(paths):
        if path.is_dir():
            inside = sorted(child for child in path.iterdir() if child.suffix.lower() in suffixes)
            if not inside:
                raise LogError(f"{path}: holds no log ({', '.join(suffixes)})")
            found += inside
        elif path.exists():
            found.append(path)
        else:
            raise LogError(f"{path}: does not exist")
    if not found:
        raise LogError("no log given")
    return list(dict.fromkeys(found))
