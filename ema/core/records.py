"""Records of measured or simulated cycles: named channels in the units of `ema.core.names`.

>>> record = read_record("flight.csv")
>>> require(record, ("t", "i_a", "theta_m"), min_samples=100)
>>> for cycle in record.cycles:
...     cycle["i_a"]
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import RecordError
from .names import CHANNELS

if TYPE_CHECKING:
    from .sidecar import Sidecar

Array = NDArray[np.float64]

# A reader of another file kind registers itself under its suffix, for example ".mcap".
READERS_GROUP = "ema.record_readers"
TEXT = ".csv"


@dataclass(frozen=True)
class Cycle:
    """One cycle: channels of equal length. `label` says where it came from, for messages."""

    number: int
    channels: Mapping[str, Array]
    label: str = ""

    def __post_init__(self) -> None:
        unknown = sorted(set(self.channels) - set(CHANNELS))
        if unknown:
            raise RecordError(f"{self}: unknown channel {', '.join(unknown)} (known: {', '.join(CHANNELS)})")
        lengths = {name: np.shape(values) for name, values in self.channels.items()}
        if len(set(lengths.values())) > 1 or any(len(shape) != 1 for shape in lengths.values()):
            raise RecordError(f"{self}: channels must be one-dimensional and of one length, are {lengths}")

    def __str__(self) -> str:
        return self.label or f"cycle {self.number}"

    def __getitem__(self, name: str) -> Array:
        try:
            return self.channels[name]
        except KeyError:
            raise RecordError(f"{self}: channel '{name}' [{CHANNELS[name].unit}] is missing") from None

    def __contains__(self, name: str) -> bool:
        return name in self.channels

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.channels.values()))) if self.channels else 0

    @property
    def period(self) -> float:
        """Median time between samples. [s]"""
        return float(np.median(np.diff(self["t"])))

    def rows(self, start: int, stop: int) -> Cycle:
        """Part of the cycle, samples `start` to `stop` (excluded)."""
        return Cycle(self.number, {name: x[start:stop] for name, x in self.channels.items()}, self.label)


@dataclass(frozen=True)
class Record:
    """Cycles of (possibly) unequal length with the same channels.

    `ignored` names the columns of the file that are not channels; `resolution` the steps of the measurement
    where they are known [unit of the channel]; `broken` the numbers of cycles that were left out for their gaps;
    `complaints` what the file contradicts itself in, a line each.
    """

    cycles: tuple[Cycle, ...]
    source: Path | None = None
    ignored: tuple[str, ...] = ()
    resolution: Mapping[str, float] = field(default_factory=dict)
    broken: tuple[int, ...] = ()
    complaints: tuple[str, ...] = ()

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that every cycle has."""
        if not self.cycles:
            return ()
        return tuple(name for name in self.cycles[0].channels if all(name in cycle for cycle in self.cycles))

    @property
    def is_at_rest(self) -> bool:
        """Whether these are readings at rest, one after the other: its speed is zero throughout."""
        speeds = [name for name in ("w_m", "v") if name in self.channels]
        return bool(speeds) and not any(cycle[name].any() for name in speeds for cycle in self.cycles)

    @property
    def n_cycles(self) -> int:
        """Number of cycles."""
        return len(self.cycles)

    @property
    def name(self) -> str:
        """The file's name, for messages."""
        return str(self.source) if self.source else "record"

    def __iter__(self) -> Iterator[Cycle]:
        return iter(self.cycles)


def read_record(path: str | Path, plan: Sidecar | None = None) -> Record:
    """Read a record: a table with its sidecar, or what a registered reader knows by its suffix.

    `plan` says what the columns are where no sidecar does (`ema.core.sidecar`).

    Raises
    ------
    RecordError
        One line: what is wrong, in which file and line.
    """
    path = Path(path)
    if path.is_dir():
        raise RecordError(f"{path}: is a directory, not a record")
    if not path.exists():
        raise RecordError(f"{path}: no such file")
    return _reader(path.suffix.lower())(path, plan)


def each_once(paths: Iterable[Path]) -> list[Path]:
    """The records' files; RecordError for one given twice, which would count as evidence of its own."""
    found: dict[Path, Path] = {}
    contents: dict[bytes, Path] = {}
    for path in paths:
        if path.resolve() in found:
            raise RecordError(f"{path}: is given twice (a folder stands for every log in it)")
        found[path.resolve()] = path
        if path.is_file():
            original = contents.setdefault(_digest(path), path)
            if original is not path:
                raise RecordError(f"{path}: is given twice: {original} holds the same, byte for byte")
    return list(found.values())


def _digest(path: Path) -> bytes:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def _reader(suffix: str) -> Callable[[Path, Sidecar | None], Record]:
    """What reads files of this suffix; tables in text have many, so the rest is read as one."""
    for name in (suffix, TEXT):
        for entry in entry_points(group=READERS_GROUP, name=name):
            reader: Callable[[Path, Sidecar | None], Record] = entry.load()
            return reader
    raise RecordError("no reader of records is installed: install the project again ('make env' in a clone)")


def require(
    record: Record,
    channels: Collection[str],
    *,
    min_samples: int = 2,
    min_cycles: int = 1,
    varying: Collection[str] = (),
) -> None:
    """Raise RecordError if the record lacks channels, cycles, samples, or a channel that must vary is constant."""
    missing = [name for name in channels if name not in record.channels]
    if missing:
        wanted = ", ".join(f"{name} [{CHANNELS[name].unit}]" for name in missing)
        ignored = f"; columns not understood: {', '.join(record.ignored)}" if record.ignored else ""
        have = ", ".join(record.channels) or "none"
        raise RecordError(f"{record.name}: missing channel {wanted} (has {have}{ignored})")
    if record.n_cycles < min_cycles:
        raise RecordError(f"{record.name}: {record.n_cycles} cycles, at least {min_cycles} are needed")
    for cycle in record.cycles:
        if cycle.n_samples < min_samples:
            raise RecordError(
                f"{record.name}: {cycle} has {cycle.n_samples} samples, at least {min_samples} are needed"
            )
    for name in varying:
        if all(np.ptp(cycle[name]) == 0.0 for cycle in record.cycles):
            value = record.cycles[0][name][0]
            raise RecordError(f"{record.name}: channel {name} is constant at {value:g} {CHANNELS[name].unit}")
