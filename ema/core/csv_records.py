"""CSV records: a header of `name [unit]`, an optional `cycle` column, `t` restarting with each cycle."""

from __future__ import annotations

import csv
import os
import tempfile
from pathlib import Path

from . import sidecar
from .errors import RecordError
from .names import CHANNELS
from .records import Record
from .table_records import record_of
from .text_table import read_text


def read_csv(path: str | Path, plan: sidecar.Sidecar | None = None) -> Record:
    """Read a CSV record with its sidecar, or by `plan` where it has none; RecordError names file and line."""
    path = Path(path)
    side = sidecar.of(path, plan)
    return record_of(read_text(path, side), side)


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
