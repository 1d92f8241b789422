"""What the numbers of a stranger's columns show that their titles do not say: a supply, a torque that was computed."""

from __future__ import annotations

import numpy as np

from ema.core.errors import RecordError
from ema.core.records import Array
from ema.core.table import Table

FEWEST = 20  # rows; fewer show nothing
STEADY = 0.1  # of its mean: what stays within that of it is steady
BOTH_WAYS = 0.1  # of the larger end: what goes that far to the other side too has been reversed
ROUNDED = 0.01  # of its rms: what a computed column may miss by rounding


class Shown:
    """The numbers of a table's columns, read when they are asked for."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._read: dict[int, Array | None] = {}

    def _numbers(self, index: int) -> Array | None:
        if index not in self._read:
            self._read[index] = self._read_numbers(index) if len(self._table.lines) >= FEWEST else None
        return self._read[index]

    def _read_numbers(self, index: int) -> Array | None:
        try:
            (column,) = self._table.numbers([index])
        except RecordError:
            return None
        return column if np.isfinite(column).all() else None

    def ends(self, index: int) -> str:
        """From where to where a column goes, in words; empty where it is no numbers."""
        x = self._numbers(index)
        return "" if x is None else f"goes from {x.min():.6g} to {x.max():.6g}"

    def rises(self, index: int) -> bool:
        """Whether a column rises from row to row, as time does."""
        x = self._numbers(index)
        return x is not None and bool((np.diff(x) > 0.0).all())

    def is_zero(self, index: int) -> bool:
        """Whether a column is zero in all rows."""
        x = self._numbers(index)
        return x is not None and not x.any()

    def feeds(self, index: int, others: list[int]) -> bool:
        """Whether a voltage stays as it is while one of `others`, currents or speeds, goes both ways."""
        u = self._numbers(index)
        if u is None or np.abs(u - u.mean()).max() > STEADY * abs(float(u.mean())):
            return False
        columns = (self._numbers(k) for k in others)
        return any(x is not None and min(x.max(), -x.min()) > BOTH_WAYS * np.abs(x).max() for x in columns)

    def ratio(self, index: int, others: list[int]) -> tuple[int, float] | None:
        """That one of `others` of which a column is a multiple, and how many times; None where it is of none."""
        y = self._numbers(index)
        for k in others:
            x = self._numbers(k)
            if y is None or x is None or not x.any() or not y.any():
                continue
            times = float(x @ y / (x @ x))
            if np.linalg.norm(y - times * x) < ROUNDED * np.linalg.norm(y):
                return k, times
        return None
