"""Several files of the same flight, told by what they hold: a copy under another name, cut short, or recovered."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import NamedTuple

from .records import ChunkHead
from .scan import Damage, McapFile, RawMessage

N_FIRST = 8  # messages that are compared: their times are to the nanosecond, their contents noisy
N_CHUNKS = 4  # chunks of which one in common is enough: damage to the others hides no copy


class Copy(NamedTuple):
    """A file that is left out, and the one that is read in its place."""

    path: Path
    original: Path

    def __str__(self) -> str:
        return f"{self.path}: is the same flight as {self.original} and is not counted twice"


class _Mark(NamedTuple):
    first: tuple[RawMessage, ...]  # a recovery keeps them
    chunks: frozenset[ChunkHead]

    @classmethod
    def of(cls, file: McapFile) -> _Mark:
        first = tuple(islice(file.messages(lambda topic: True), N_FIRST))
        return cls(first, frozenset(head._replace(data=0) for head in islice(file.chunk_heads(), N_CHUNKS)))

    def same(self, other: _Mark) -> bool:
        n = min(len(self.first), len(other.first))
        return (n > 0 and self.first[:n] == other.first[:n]) or not self.chunks.isdisjoint(other.chunks)


def each_flight_once(files: list[McapFile]) -> tuple[list[McapFile], list[Copy]]:
    """The files in their order without those whose flight another one holds; of copies the soundest stays."""
    if len(files) < 2:
        return files, []
    flights: list[list[tuple[McapFile, _Mark]]] = []
    for file in files:
        mark = _Mark.of(file)
        same = next((flight for flight in flights if any(mark.same(its) for _, its in flight)), None)
        if same is None:
            flights.append([(file, mark)])
        else:
            same.append((file, mark))
    kept: set[McapFile] = set()
    copies: list[Copy] = []
    for flight in flights:
        given = [file for file, _ in flight]
        best = min(given, key=_lost) if len(given) > 1 else given[0]
        kept.add(best)
        copies += [Copy(file.path, best.path) for file in given if file is not best]
    return [file for file in files if file in kept], copies


def _lost(file: McapFile) -> tuple[int, bool, int]:
    """What a file lacks, for an order: messages that can be read (most first), not finished, damages."""
    damage: list[Damage] = []
    again = McapFile(file.path, damage.append)
    try:
        n = sum(len(block.messages) for block in again.blocks())
        return -n, not again.finished, len(damage)
    finally:
        again.close()
