"""The sidecar that `ema records map` proposes, with a comment at each column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

if TYPE_CHECKING:
    from ema.core.sidecar import Sidecar
    from ema.core.table import Table
    from ema.discrepancy.records.naming import Proposal


SAID = {
    "at_rest": "  # no column looks like a time: readings at rest, one after the other? else map a counter as t",
    "encoding": "  # it is no UTF-8",
    "skip_rows": "  # lines above the titles",
}


def table_of(path: Path) -> tuple[Table, Sidecar]:
    """The table in a file of any kind that has columns, and how a text is to be read; RecordError in one line."""
    from ema.core import binary_tables, sidecar
    from ema.core.errors import RecordError
    from ema.core.files import require_file
    from ema.core.text_table import above_titles, read_text

    try:
        data = require_file(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from error
    suffix = path.suffix.lower()
    if suffix == ".mcap":
        raise RecordError(f"{path}: is a log, its channels have names already; see 'ema records check {path}'")
    if suffix == ".parquet":
        return binary_tables.parquet_table(path), sidecar.Sidecar()
    if suffix == ".mat":
        return binary_tables.mat_table(path), sidecar.Sidecar()
    side = sidecar.Sidecar()
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError:
        side = sidecar.Sidecar(encoding="cp1252")  # of test benches
    side = side.model_copy(update={"skip_rows": above_titles(path, side)})
    return read_text(path, side), side


def as_sidecar(name: str, proposals: Sequence[Proposal], side: Sidecar) -> str:
    """YAML of a sidecar for the file `name`."""
    form = [
        f"{key}: {_scalar(value)}{SAID.get(key, '')}" for key, value in side.model_dump(exclude_defaults=True).items()
    ]
    lines = [
        f"# What the columns of {name} seem to be, by title and unit. Read it, and mend what is not so.",
        *form,
        "columns:",
    ]
    for one in proposals:
        value = "ignore" if one.channel is None else _mapping(one)
        lines.append(f"  {_scalar(one.title)}: {value}  # {one.said}")
    return "\n".join(lines) + "\n"


def _mapping(one: Proposal) -> str:
    return f"{{channel: {one.channel}, unit: {_scalar(one.unit)}}}"


def _scalar(text: str | float | None) -> str:
    """As YAML writes a text: in quotes where it would be read as something else."""
    said: str = yaml.safe_dump([text], default_flow_style=True, allow_unicode=True, width=1000)
    return said.strip()[1:-1]
