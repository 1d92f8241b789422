"""The true faults of each cycle as a CSV file, to compare estimates with."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from ema.core.closing import Closing
from ema.core.errors import ConfigError
from ema.core.names import FAULTS

if TYPE_CHECKING:
    from .fleet import CycleData

COLUMNS = ("cycle", "actuator", "t [s]", *FAULTS, "temp_w [°C]")


class TruthFile(Closing):
    """Writes one row for each actuator and cycle, at once readable by others."""

    def __init__(self, path: str | Path, numbers: list[int]):
        self._numbers = numbers
        try:
            self._file = open(path, "x", encoding="utf-8", newline="")  # noqa: SIM115 - closed by __exit__
        except FileExistsError as error:
            raise ConfigError(f"{path}: exists already, is not overwritten") from error
        except OSError as error:
            raise ConfigError(f"{path}: cannot be written ({error.strerror})") from error
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(COLUMNS)
        self._file.flush()

    def add(self, cycle: CycleData) -> None:
        """Write the rows of a cycle."""
        for number, k, temp_w in zip(self._numbers, cycle.k.tolist(), cycle.temp_w.tolist(), strict=True):
            self._writer.writerow([cycle.number, number, cycle.t_start, *k, temp_w])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
