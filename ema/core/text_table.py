"""Tables in text files: CSV as it comes, whatever its delimiter, decimal sign, comments and row of units are."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .errors import RecordError
from .files import require_file
from .sidecar import Sidecar
from .table import Array, Table
from .units import is_unit

_DELIMITERS = (",", ";", "\t", "|", " ")  # " " stands for any white space
_COMMENTS = ("#", "%", "//")
UNTITLED = "column "  # and its number, counted from 1, is the title of a column in a file that has none
_LOOKED_AT = 50  # rows from which delimiter and decimal sign are read


class Dialect(NamedTuple):
    """How a file writes its numbers."""

    delimiter: str
    decimal: str

    def split(self, line: str) -> list[str]:
        """Fields of one line."""
        if self.delimiter == " ":
            return line.split()
        return [field.strip() for field in next(csv.reader([line], delimiter=self.delimiter))]

    def number(self, field: str) -> float:
        """Value of a field; ValueError where it is none."""
        return float(field if self.decimal == "." else field.replace(".", "").replace(",", "."))

    def is_number(self, field: str) -> bool:
        """Whether a field is one."""
        try:
            self.number(field)
        except ValueError:
            return False
        return True


def read_text(path: Path, side: Sidecar) -> Table:
    """Read a text file; what the sidecar does not say of its form is seen from the file."""
    numbered = _lines(path, side)
    if not numbered:
        raise RecordError(f"{path}: is empty")
    if len(numbered) == 1:
        raise RecordError(f"{path}: has a header and no rows")
    if all(text.rstrip().endswith(";") for _, text in numbered[1:]) and ";" not in numbered[0][1]:
        numbered = [(number, text.rstrip().rstrip(";")) for number, text in numbered]  # ends of statements, no fields
    texts = [text for _, text in numbered]
    dialect = _dialect(texts[: _LOOKED_AT + 1], side)
    header = [name.strip() for name in dialect.split(texts[0])]
    first, units = 1, {}
    if untitled := all(dialect.is_number(field) for field in header):
        header, first = [f"{UNTITLED}{k}" for k in range(1, len(header) + 1)], 0
    if len(texts) > 2 and not untitled and (found := _units(dialect, texts[1])) and len(found) == len(header):
        first, units = 2, {index: unit for index, unit in enumerate(found) if unit}
    body, lines = texts[first:], [number for number, _ in numbered[first:]]

    def numbers(used: Sequence[int]) -> list[Array]:
        return _numbers(path, header, body, lines, dialect, used)

    return Table(path, header, numbers, lines, "line", units)


def above_titles(path: Path, side: Sidecar) -> int:
    """Lines above the titles: the row before the first numbers, or the one before that where it holds units."""
    numbered = _lines(path, side)
    numeric = [_is_numeric(text) and len(text.replace(",", " ").replace(";", " ").split()) > 1 for _, text in numbered]
    first = next((k for k in range(1, len(numeric)) if all(numeric[k : k + 3])), 1)
    titles = first - 1
    if titles > 0:
        dialect = _dialect([text for _, text in numbered[titles : titles + _LOOKED_AT]], side)
        titles -= _units(dialect, numbered[titles][1]) is not None
    return numbered[titles][0] - 1 if titles > 0 else 0


def _lines(path: Path, side: Sidecar) -> list[tuple[int, str]]:
    """Header and rows with their place in the file; blank lines and comments are left out."""
    try:
        text = require_file(path).read_text(encoding=side.encoding)
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        name = "UTF-8" if side.encoding == "utf-8-sig" else side.encoding
        raise RecordError(
            f"{path}: is not {name} text (byte {error.start}); the sidecar may say encoding: latin-1"
        ) from error
    marks = (side.comment,) if side.comment else _COMMENTS
    kept: list[tuple[int, str]] = []
    last_comment: tuple[int, str] | None = None
    for number, line in enumerate(text.split("\n"), start=1):
        if number <= side.skip_rows or not line.strip():
            continue
        if line.lstrip().startswith(marks):
            last_comment = (number, line.lstrip().lstrip("#%/ ")) if not kept else last_comment
        else:
            kept.append((number, line.rstrip("\r")))
    if kept and last_comment and not side.comment and _is_numeric(kept[0][1]):
        return [last_comment, *kept]  # the titles are the last comment above the numbers
    return kept


def _is_numeric(line: str) -> bool:
    fields = line.replace(";", " ").replace("\t", " ").replace(",", " ").split()
    return bool(fields) and all(_is_number(field) for field in fields)


def _is_number(field: str) -> bool:
    return Dialect(",", ".").is_number(field)


def _dialect(texts: list[str], side: Sidecar) -> Dialect:
    """The delimiter that splits most rows as it does the titles; a decimal comma where fields have one."""
    delimiter = side.delimiter
    if delimiter is None:

        def fit(candidate: str) -> tuple[bool, int, bool, int]:
            split = Dialect(candidate, ".").split
            fields = split(texts[0])
            n = len(fields)  # white space may also stand around what parts the fields, as in "0 | 1"
            all_numbers = n > 1 and all(Dialect(candidate, "," if "," in f else ".").is_number(f) for f in fields)
            return all_numbers, sum(len(split(text)) == n for text in texts[1:]) if n > 1 else 0, candidate != " ", n

        delimiter = max(_DELIMITERS, key=fit)
        if fit(delimiter)[1] == 0:
            delimiter = ","
    if side.decimal:
        return Dialect(delimiter, side.decimal)
    plain = Dialect(delimiter, ".")
    fields = [field for text in texts[1:] for field in plain.split(text)]
    with_comma = [field for field in fields if "," in field and _is_number(field.replace(",", ".", 1))]
    with_point = any("." in field and _is_number(field) for field in fields)
    return Dialect(delimiter, "," if delimiter != "," and with_comma and not with_point else ".")


def _units(dialect: Dialect, line: str) -> list[str] | None:
    """Units in a row of their own below the titles; None where the row is none."""
    fields = [field.strip("[]()") for field in dialect.split(line)]
    if not any(fields) or any(_is_number(field.replace(",", ".")) for field in fields if field):
        return None
    return fields if all(not field or field in ("-", "1") or is_unit(field) for field in fields) else None


def _numbers(
    path: Path, header: list[str], body: list[str], lines: list[int], dialect: Dialect, used: Sequence[int]
) -> list[Array]:
    """Columns `used` of the body as numbers."""
    delimiter = None if dialect.delimiter == " " else dialect.delimiter
    if dialect.decimal == "." and (delimiter is None or all(line.count(delimiter) == len(header) - 1 for line in body)):
        try:
            stream = io.StringIO("\n".join(body))
            table = np.loadtxt(stream, delimiter=delimiter, ndmin=2, comments=None)
            if table.shape[1] == len(header):
                return list(table.T[list(used)])
        except ValueError:
            pass  # the careful way says which line is wrong, and reads past text in columns that are not used
    columns = np.empty((len(used), len(body)))
    for index, (line, text) in enumerate(zip(lines, body, strict=True)):
        row = dialect.split(text)
        if len(row) != len(header):
            cut = " (cut off?)" if index == len(body) - 1 else ""
            raise RecordError(f"{path}, line {line}: has {len(row)} of {len(header)} fields{cut}")
        for place, column in enumerate(used):
            try:
                columns[place, index] = dialect.number(row[column])
            except ValueError:
                shown = row[column].strip()[:40]
                problem = f"{shown!r} is not a number" if shown else "is empty"
                raise RecordError(f"{path}, line {line}: column '{header[column]}' {problem}") from None
    return list(columns)
