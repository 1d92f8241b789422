"""Records in Parquet and MATLAB files: columns by name, their meaning by the sidecar, as for text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import sidecar
from .errors import RecordError
from .files import require_file
from .records import Record
from .table import Array, Table
from .table_records import record_of


def read_parquet(path: str | Path, plan: sidecar.Sidecar | None = None) -> Record:
    """Read a Parquet file with its sidecar, or by `plan` where it has none."""
    path = Path(path)
    return record_of(parquet_table(path), sidecar.of(path, plan))


def parquet_table(path: Path) -> Table:
    """The table in a Parquet file; a column of time stamps counts from its first one. [s]"""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        read = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise RecordError(f"{path}: cannot be read as Parquet ({' '.join(str(error).split())[:120]})") from error
    columns, units = {}, {}
    for index, name in enumerate(read.column_names):
        values = read.column(index)
        if pa.types.is_timestamp(values.type) or pa.types.is_duration(values.type):
            t_ns = values.cast(pa.timestamp("ns") if pa.types.is_timestamp(values.type) else pa.duration("ns"))
            whole = np.asarray(t_ns.to_numpy()).astype(np.int64)
            columns[name], units[index] = (whole - whole[0]) / 1e9, "s"
        else:
            columns[name] = values.to_numpy()
    return _table(path, columns, units)


def read_mat(path: str | Path, plan: sidecar.Sidecar | None = None) -> Record:
    """Read a MATLAB file with its sidecar, or by `plan` where it has none."""
    path = Path(path)
    return record_of(mat_table(path), sidecar.of(path, plan))


def mat_table(path: Path) -> Table:
    """The table in a MATLAB file (v4 to v7.2 by scipy, v7.3 by h5py): its vectors of the commonest length.

    Fields of structures are named ``structure.field``; the columns of a matrix ``name_1``, ``name_2`` …
    """
    try:
        with require_file(path).open("rb") as file:
            is_hdf = b"MATLAB 7.3" in file.read(128)
        vectors = dict(_vectors(_hdf(path) if is_hdf else _matlab(path)))
    except ModuleNotFoundError as error:
        raise RecordError(f"{path}: MATLAB 7.3 needs h5py: pip install 'ema-monitor[analyse]'") from error
    except (OSError, ValueError, TypeError, NotImplementedError, KeyError) as error:
        raise RecordError(f"{path}: cannot be read as MATLAB file ({' '.join(str(error).split())[:120]})") from error
    if not vectors:
        raise RecordError(f"{path}: holds no vector of numbers")
    ((n, _),) = Counter(len(x) for x in vectors.values() if len(x) > 1).most_common(1) or [(1, 0)]
    return _table(path, {name: x for name, x in vectors.items() if len(x) == n}, {})


def _matlab(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        loaded: dict[str, Any] = loadmat(path, simplify_cells=True)
    except MatReadError as error:
        raise ValueError(str(error)) from error
    return {name: value for name, value in loaded.items() if not name.startswith("__")}


def _hdf(path: Path) -> dict[str, Any]:
    import h5py

    found: dict[str, Any] = {}

    def keep(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#") and item.dtype.kind in "fiu":
            found[name.replace("/", ".")] = np.asarray(item).T  # MATLAB's order of indices

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


def _vectors(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    for name, value in values.items():
        title = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from _vectors(value, f"{title}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            continue
        if array.ndim == 2 and min(array.shape) > 1:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            yield from ((f"{title}_{j + 1}", column) for j, column in enumerate(tall.T))
        elif array.size > 1 and array.ndim <= 2:
            yield title, array.ravel()


def _table(path: Path, columns: Mapping[str, np.ndarray], units: Mapping[int, str]) -> Table:
    header = list(columns)
    n = len(next(iter(columns.values()))) if columns else 0
    if n < 1:
        raise RecordError(f"{path}: has no rows")

    def numbers(used: Sequence[int]) -> list[Array]:
        found = []
        for index in used:
            try:
                found.append(np.asarray(columns[header[index]], dtype=float))
            except (TypeError, ValueError):
                raise RecordError(f"{path}: column '{header[index]}' does not hold numbers") from None
        return found

    return Table(path, header, numbers, range(1, n + 1), "row", units)
