"""Tables to files: CSV, or Parquet (needs pyarrow, an extra)."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from ema.core.closing import Closing
from ema.core.errors import LogError

from .tables import Block


class TableFiles(Closing):
    """One new file for each table in a directory; blocks are appended as they come.

    The header names each column with its unit. Parquet columns also carry the unit as metadata of their field.
    """

    def __init__(self, directory: Path, kind: str):
        self._directory, self._kind = directory, kind
        self._files: dict[Path, Any] = {}
        self.rows: dict[Path, int] = {}

    def write(self, block: Block) -> None:
        """Append rows. LogError when a file exists already or cannot be written."""
        path = self._directory / f"{block.table}.{self._kind}"
        try:
            if path not in self._files:
                self._directory.mkdir(parents=True, exist_ok=True)
                self._files[path] = (_Csv if self._kind == "csv" else _Parquet)(path, block)
                self.rows[path] = 0
            self._files[path].write(block)
        except FileExistsError as error:
            raise LogError(f"{error.filename}: exists, and is not overwritten") from error
        except OSError as error:
            raise LogError(f"{path}: cannot be written ({error.strerror or error})") from error
        self.rows[path] += len(block.values[0])

    def held(self) -> dict[Path, int]:
        """Rows in each finished file, read back."""
        return {path: file.held(path) for path, file in self._files.items()}

    def check(self) -> None:
        """LogError where a finished file does not hold all rows that were written."""
        for path, rows in self.held().items():
            if rows != self.rows[path]:
                raise LogError(f"{path}: holds {rows} of {self.rows[path]} rows")

    def close(self) -> None:
        """Finish all files."""
        for file in self._files.values():
            file.close()


class _Csv:
    def __init__(self, path: Path, block: Block):
        self._file = path.open("x", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._writer.writerow([str(column) for column in block.columns])

    def write(self, block: Block) -> None:
        self._writer.writerows(zip(*block.values, strict=True))

    def held(self, path: Path) -> int:
        with path.open(newline="", encoding="utf-8") as file:
            return sum(1 for _ in csv.reader(file)) - 1

    def close(self) -> None:
        self._file.close()


class _Parquet:
    def __init__(self, path: Path, block: Block):
        try:
            import pyarrow as pa
            import pyarrow.parquet as pq
        except ImportError as error:
            raise LogError("Parquet needs pyarrow: pip install 'ema-monitor[analyse]'") from error
        self._arrow = pa
        kinds = [_arrow_type(pa, values) for values in block.values]
        self._schema = pa.schema(
            [
                pa.field(str(column), kind, metadata={"unit": column.unit})
                for column, kind in zip(block.columns, kinds, strict=True)
            ]
        )
        self._file = path.open("xb")
        self._writer = pq.ParquetWriter(self._file, self._schema)

    def write(self, block: Block) -> None:
        arrays = [
            self._arrow.array(values, type=field.type) for values, field in zip(block.values, self._schema, strict=True)
        ]
        self._writer.write_table(self._arrow.table(arrays, schema=self._schema))

    def held(self, path: Path) -> int:
        import pyarrow.parquet as pq

        return int(pq.ParquetFile(path).metadata.num_rows)

    def close(self) -> None:
        self._writer.close()
        self._file.close()


def _arrow_type(pa: Any, values: list[Any]) -> Any:
    seen = next((value for value in values if value is not None), 0.0)
    return pa.string() if isinstance(seen, str) else pa.int64() if isinstance(seen, int) else pa.float64()
