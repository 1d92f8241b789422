"""From a table and what is known of its columns to a record: names, units, signs, and which rows are one cycle."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from . import sidecar
from .errors import RecordError
from .names import CHANNELS
from .records import Array, Cycle, Record
from .table import Table
from .units import convert, is_unit

NONE = "1"  # the unit of a ratio, which a column need not name
_HEADER = re.compile(r"^(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")
_ROUND = re.compile(r"^(?P<name>[^()]+?)\s*\((?P<unit>[^()]+)\)$")


def record_of(table: Table, side: sidecar.Sidecar) -> Record:
    """The record that a table holds; RecordError names file and line."""
    path, header = table.path, table.header
    columns = _columns(table, side)
    rule = side.cycles.column if side.cycles else None
    if rule is not None and rule not in header:
        raise RecordError(f"{side.whence(path)}: cycles.column '{rule}' is no column of {path.name}")
    used = sorted({*columns, *([header.index(rule)] if rule else [])})
    values = dict(zip(used, table.numbers(used), strict=True))
    channels: dict[str, Array] = {}
    resolution: dict[str, float] = {}
    for index, (name, (scale, offset), step) in columns.items():
        channels[name] = scale * values[index] + offset
        if step is not None:
            resolution[name] = step
    if side.at_rest:
        channels = _at_rest(channels, len(table.lines))
    if "t" not in channels:
        raise RecordError(
            f"{path}: missing column 't [s]' (columns: {', '.join(header)}); where it has another title, "
            f"'ema records map {path}' proposes what the columns are"
        )
    # what the owner says is to be ignored is understood
    ignored = tuple(name for index, name in enumerate(header) if index not in columns and name not in side.columns)
    number = channels.pop("cycle", None)
    marks = values[header.index(rule)] if rule else None
    cycles = tuple(_cycles(table, side, channels, number, marks))
    return Record(cycles, path, ignored, resolution)


def _at_rest(channels: dict[str, Array], n: int) -> dict[str, Array]:
    """Readings that follow each other: time counts them, and nothing moves."""
    speed = "v" if "q" in channels else "w_m"
    return {**channels, "t": np.arange(float(n)), speed: np.zeros(n)}


def titled(title: str) -> tuple[str, str | None]:
    """Name and unit of a column's title: ``name [unit]`` or ``name (unit)``."""
    match = _HEADER.match(title)
    if match and match["unit"] is not None:
        return match["name"].strip(), match["unit"].strip()
    if (match := _ROUND.match(title)) and is_unit(match["unit"]):
        return match["name"].strip(), match["unit"].strip()
    return title.strip(), None


_Column = tuple[str, tuple[float, float], float | None]


def _columns(table: Table, side: sidecar.Sidecar) -> dict[int, _Column]:
    """Channel, linear map to its unit and resolution, by index of the column."""
    path, header = table.path, table.header
    absent = sorted(set(side.columns) - set(header))
    if absent:
        raise RecordError(f"{side.whence(path)}: no column {', '.join(absent)} in {path.name} ({', '.join(header)})")
    found: dict[int, _Column] = {}
    for index, title in enumerate(header):
        column = side.columns.get(title)
        if title in side.columns and column is None:
            continue
        own, given = titled(title)
        name = column.channel if column else own
        if name not in CHANNELS and name != "cycle":
            continue
        if any(name == other for other, _, _ in found.values()):
            raise RecordError(f"{path}: channel '{name}' is given twice")
        unit = (column.unit if column else None) or given or table.units.get(index)
        if name == "cycle":
            found[index] = (name, (1.0, 0.0), None)
            continue
        if unit is None and CHANNELS[name].unit == NONE:
            unit = NONE
        if unit is None:
            raise RecordError(
                f"{path}: column '{title}' has no unit, expected '{name} [{CHANNELS[name].unit}]' or a unit in "
                f"{sidecar.beside(path).name}"
            )
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
    table: Table, side: sidecar.Sidecar, channels: dict[str, Array], number: Array | None, marks: Array | None
) -> Iterator[Cycle]:
    path, lines, place = table.path, table.lines, table.place
    for name, values in {**channels, **({} if number is None else {"cycle": number})}.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            more = f" and {bad.size - 1} more" if bad.size > 1 else ""
            raise RecordError(f"{path}, {place} {lines[bad[0]]}{more}: {name} is not a finite number")
    if number is not None and np.any(number != np.round(number)):
        row = int(np.argmax(number != np.round(number)))
        raise RecordError(f"{path}, {place} {lines[row]}: cycle is not an integer")
    n_rows = len(lines)
    carved = side.cycles is not None
    parts = _parts(side.cycles, channels["t"], number, marks)
    used: set[int] = set()
    for count, (start, stop) in enumerate(parts):
        if stop > n_rows:
            raise RecordError(
                f"{side.whence(path)}: cycles.rows [{start}, {stop}] lie outside the {n_rows} rows of {path.name}"
            )
        identity = count if carved or number is None else int(number[start])
        if identity in used:
            raise RecordError(
                f"{path}, {place} {lines[start]}: cycle {identity} comes up again; its rows must be together"
            )
        used.add(identity)
        part = {name: values[start:stop] for name, values in channels.items()}
        back = np.flatnonzero(np.diff(part["t"]) <= 0)
        if back.size:
            row = start + int(back[0]) + 1
            hint = "" if carved or number is not None else "; a record of several cycles needs a `cycle` column"
            before, after = channels["t"][row - 1 : row + 1]
            raise RecordError(f"{path}, {place} {lines[row]}: t goes from {before:g} to {after:g} s{hint}")
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
