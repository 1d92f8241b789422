"""A table as files hold it: titles, numbers, and where each row stands; `table_records` knows what they mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Columns of one file.

    Attributes
    ----------
    path : Path
    header : list of str
        Titles of the columns.
    numbers : callable
        Columns at the given indices as arrays of float; RecordError names the place of what is no number.
    lines : sequence of int
        Where in the file each row stands, for messages.
    place : str
        What such a place is called: line, row.
    units : mapping of int to str
        Units that the file gives apart from the titles, by index of the column.
    """

    path: Path
    header: list[str]
    numbers: Callable[[Sequence[int]], list[Array]]
    lines: Sequence[int]
    place: str = "line"
    units: Mapping[int, str] = field(default_factory=dict)
