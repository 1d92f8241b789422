"""CSV records: a header of `name [unit]`, an optional `cycle` column, `t` restarting with each cycle."""

from __future__ import annotations

import csv
import io
import os
import re
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from . import sidecar
from .errors import RecordError
from .names import CHANNELS
from .records import Array, Cycle, Record
from .units import convert

_HEADER = re.compile(r"^(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")


def read_csv(path: str | Path) -> Record:
    """Read a CSV record with its sidecar; RecordError names file and line."""
    path = Path(path)
    side = sidecar.read(path)
    header, body, lines = _text(path, side)
    columns = _columns(path, header, side)
    rule = side.cycles.column if side.cycles else None
    if rule is not None and rule not in header:
        raise RecordError(f"{sidecar.beside(path)}: cycles.column '{rule}' is no column of {path.name}")
    used = sorted({*columns, *([header.index(rule)] if rule else [])})
    table = dict(zip(used, _numbers(path, header, body, lines, side.delimiter, used), strict=True))
    channels: dict[str, Array] = {}
    resolution: dict[str, float] = {}
    for index, (name, (scale, offset), step) in columns.items():
        channels[name] = scale * table[index] + offset
        if step is not None:
            resolution[name] = step
    if "t" not in channels:
        raise RecordError(f"{path}: missing column 't [s]' (columns: {', '.join(header)})")
    ignored = tuple(name for index, name in enumerate(header) if index not in columns)
    number = channels.pop("cycle", None)
    marks = table[header.index(rule)] if rule else None
    cycles = tuple(_cycles(path, side, channels, number, marks, lines))
    return Record(cycles, path, ignored, resolution)


def refuse_taken(path: Path) -> None:
    """RecordError where no new record can be written: to be asked before the work that it shall hold."""
    if path.exists():
        raise RecordError(f"{path}: exists already, is not overwritten")
    if not path.parent.is_dir():
        raise RecordError(f"{path}: cannot be written ({path.parent} is no directory)")


def write_csv(record: Record, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a record so that reading it gives the same numbers; refuses to replace a file unless told."""
    path = Path(path)
    names = record.channels
    header = ["cycle", *(f"{name} [{CHANNELS[name].unit}]" for name in names)]
    if not overwrite:
        refuse_taken(path)
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    except OSError as error:
        raise RecordError(f"{path}: cannot be written ({error.strerror})") from error
    try:
        with open(handle, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            for cycle in record.cycles:
                rows = zip(*(cycle[name].tolist() for name in names), strict=True)
                writer.writerows((cycle.number, *row) for row in rows)
        os.chmod(temporary, 0o644)
        if overwrite:
            os.replace(temporary, path)
        else:
            os.link(temporary, path)  # fails where another process made the file meanwhile
    except OSError as error:
        raise RecordError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        Path(temporary).unlink(missing_ok=True)


def _text(path: Path, side: sidecar.Sidecar) -> tuple[list[str], list[str], list[int]]:
    """Header, lines of numbers and where in the file each of them stands."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise RecordError(f"{path}: is not UTF-8 text (byte {error.start})") from error
    numbered = [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=1)
        if number > side.skip_rows and line.strip() and not (side.comment and line.startswith(side.comment))
    ]
    if not numbered:
        raise RecordError(f"{path}: is empty")
    if len(numbered) == 1:
        raise RecordError(f"{path}: has a header and no rows")
    header = [name.strip() for name in next(csv.reader([numbered[0][1]], delimiter=side.delimiter))]
    return header, [line for _, line in numbered[1:]], [number for number, _ in numbered[1:]]


def _numbers(
    path: Path, header: list[str], body: list[str], lines: list[int], delimiter: str, used: list[int]
) -> list[Array]:
    """Columns `used` of the body as numbers."""
    if all(line.count(delimiter) == len(header) - 1 for line in body):
        try:
            stream = io.StringIO("\n".join(body))
            return list(np.loadtxt(stream, delimiter=delimiter, ndmin=2, comments=None, usecols=used).T)
        except ValueError:
            pass  # the careful way says which line is wrong
    columns = np.empty((len(used), len(body)))
    for index, (line, text) in enumerate(zip(lines, body, strict=True)):
        row = next(csv.reader([text], delimiter=delimiter))
        if len(row) != len(header):
            cut = " (cut off?)" if index == len(body) - 1 else ""
            raise RecordError(f"{path}, line {line}: has {len(row)} of {len(header)} fields{cut}")
        for place, column in enumerate(used):
            try:
                columns[place, index] = float(row[column])
            except ValueError:
                shown = row[column].strip()[:40]
                problem = f"{shown!r} is not a number" if shown else "is empty"
                raise RecordError(f"{path}, line {line}: column '{header[column]}' {problem}") from None
    return list(columns)


_Column = tuple[str, tuple[float, float], float | None]


def _columns(path: Path, header: list[str], side: sidecar.Sidecar) -> dict[int, _Column]:
    """Channel, linear map to its unit and resolution, by index of the column."""
    absent = sorted(set(side.columns) - set(header))
    if absent:
        raise RecordError(f"{sidecar.beside(path)}: no column {', '.join(absent)} in {path.name} ({', '.join(header)})")
    found: dict[int, _Column] = {}
    for index, title in enumerate(header):
        column = side.columns.get(title)
        if title in side.columns and column is None:
            continue
        match = _HEADER.match(title)
        name = column.channel if column else match["name"].strip() if match else title
        if name not in CHANNELS and name != "cycle":
            continue
        if any(name == other for other, _, _ in found.values()):
            raise RecordError(f"{path}: channel '{name}' is given twice")
        unit = (column.unit if column else None) or (match["unit"] if match else None)
        if name == "cycle":
            found[index] = (name, (1.0, 0.0), None)
            continue
        if unit is None:
            raise RecordError(f"{path}: column '{title}' has no unit, expected '{name} [{CHANNELS[name].unit}]'")
        try:
            scale, offset = convert(unit.strip(), CHANNELS[name].unit)
        except ValueError as error:
            raise RecordError(f"{path}: column '{title}': {error}") from None
        step = None
        if column:
            offset += scale * column.offset
            step = column.resolution * scale if column.resolution is not None else None
            scale *= column.sign * column.scale
        found[index] = (name, (scale, offset), step)
    return found


def _cycles(
    path: Path,
    side: sidecar.Sidecar,
    channels: dict[str, Array],
    number: Array | None,
    marks: Array | None,
    lines: list[int],
) -> Iterator[Cycle]:
    for name, values in {**channels, **({} if number is None else {"cycle": number})}.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            more = f" and {bad.size - 1} more" if bad.size > 1 else ""
            raise RecordError(f"{path}, line {lines[bad[0]]}{more}: {name} is not a finite number")
    if number is not None and np.any(number != np.round(number)):
        raise RecordError(f"{path}, line {lines[int(np.argmax(number != np.round(number)))]}: cycle is not an integer")
    n_rows = len(lines)
    carved = side.cycles is not None
    parts = _parts(side.cycles, channels["t"], number, marks)
    used: set[int] = set()
    for count, (start, stop) in enumerate(parts):
        if stop > n_rows:
            raise RecordError(
                f"{sidecar.beside(path)}: cycles.rows [{start}, {stop}] lie outside the {n_rows} rows of {path.name}"
            )
        identity = count if carved or number is None else int(number[start])
        if identity in used:
            raise RecordError(
                f"{path}, line {lines[start]}: cycle {identity} comes up again; its rows must be together"
            )
        used.add(identity)
        part = {name: values[start:stop] for name, values in channels.items()}
        back = np.flatnonzero(np.diff(part["t"]) <= 0)
        if back.size:
            row = start + int(back[0]) + 1
            hint = "" if carved or number is not None else "; a record of several cycles needs a `cycle` column"
            raise RecordError(
                f"{path}, line {lines[row]}: t goes from {channels['t'][row - 1]:g} to {channels['t'][row]:g} s{hint}"
            )
        if carved:  # t restarts with each cycle, also where the file's time runs through
            part["t"] = part["t"] - part["t"][0]
        yield Cycle(identity, part, f"cycle {identity}")


def _parts(rule: sidecar.Cycles | None, t: Array, number: Array | None, marks: Array | None) -> list[tuple[int, int]]:
    """Ranges of rows, one per cycle."""
    n_rows = len(t)
    if rule is None:
        edges = np.flatnonzero(np.diff(number)) + 1 if number is not None else np.array([], int)
    elif rule.rows is not None:
        return list(rule.rows)
    elif rule.length is not None:
        edges = np.arange(rule.length, n_rows, rule.length)
    elif marks is not None:
        edges = np.flatnonzero(np.diff(marks)) + 1
    else:
        step = np.diff(t)
        edges = np.flatnonzero((step > (rule.gap or np.inf)) | (step <= 0)) + 1
    bounds = [0, *edges.tolist(), n_rows]
    return list(pairwise(bounds))
