"""The sidecar that `ema records map` proposes, with a comment at each column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

if TYPE_CHECKING:
    from ema.core.table import Table
    from ema.discrepancy.records.naming import Proposal


def table_of(path: Path) -> Table:
    """The table in a file of any kind that has columns; RecordError in one line."""
    from ema.core import binary_tables, sidecar
    from ema.core.errors import RecordError
    from ema.core.files import require_file
    from ema.core.text_table import read_text

    try:
        require_file(path)
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from error
    suffix = path.suffix.lower()
    if suffix == ".mcap":
        raise RecordError(f"{path}: is a log, its channels have names already; see 'ema records check {path}'")
    if suffix == ".parquet":
        return binary_tables.parquet_table(path)
    return binary_tables.mat_table(path) if suffix == ".mat" else read_text(path, sidecar.Sidecar())


def as_sidecar(name: str, proposals: Sequence[Proposal]) -> str:
    """YAML of a sidecar for the file `name`."""
    lines = [
        f"# What the columns of {name} seem to be, by title and unit. Read it, and mend what is not so.",
        "columns:",
    ]
    for one in proposals:
        value = "ignore" if one.channel is None else _mapping(one)
        lines.append(f"  {_scalar(one.title)}: {value}  # {one.said}")
    return "\n".join(lines) + "\n"


def _mapping(one: Proposal) -> str:
    return f"{{channel: {one.channel}, unit: {_scalar(one.unit)}}}"


def _scalar(text: str | None) -> str:
    """As YAML writes a text: in quotes where it would be read as something else."""
    said: str = yaml.safe_dump([text], default_flow_style=True, allow_unicode=True, width=1000)
    return said.strip()[1:-1]
