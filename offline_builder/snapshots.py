"""Envelopes of all runs of a build in one file: written as they come, read in parts, never all in memory."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ema.core.errors import BundleError

FILE, DONE = "envelopes.f32", "blocks_done"
READ = 512  # runs read at once


class Snapshots:
    """Envelopes of `n` runs at `n_t` times, single precision. [A]

    `folder`/envelopes.f32 holds the rows, `folder`/blocks_done one byte for each block of runs, set once the block is
    on the disk. A slice of rows is read from the file when asked for.

    Raises
    ------
    BundleError
        The disk has no room for all of them, or cannot be written.
    """

    def __init__(self, folder: Path, n: int, n_t: int, block: int):
        self._folder, self._first = folder, 0
        self.shape = (n, n_t)
        self._blocks = [slice(first, min(first + block, n)) for first in range(0, n, block)]
        size = n * n_t * np.dtype(np.float32).itemsize
        try:
            for name, length in ((FILE, size), (DONE, len(self._blocks))):
                with open(folder / name, "ab") as file:
                    os.posix_fallocate(file.fileno(), 0, length)
        except OSError as error:
            raise BundleError(
                f"{folder}: no room for the {size / 1e9:.2f} GB of {n} runs ({error.strerror})"
            ) from error

    def __len__(self) -> int:
        return self.shape[0]

    def missing(self) -> list[slice]:
        """Blocks not yet written."""
        done = (self._folder / DONE).read_bytes()
        return [block for block, is_done in zip(self._blocks, done, strict=True) if not is_done]

    def write(self, block: slice, rows: np.ndarray) -> None:
        """Put a block of `missing` in its place, shape (block.stop - block.start, n_t)."""
        try:
            for name, offset, content in (
                (FILE, block.start * self.shape[1] * rows.itemsize, rows.tobytes()),
                (DONE, self._blocks.index(block), b"\1"),
            ):
                with open(self._folder / name, "r+b") as file:
                    file.seek(offset)
                    file.write(content)
                    file.flush()
                    os.fdatasync(file.fileno())
        except OSError as error:
            raise BundleError(f"{self._folder}: cannot be written ({error.strerror})") from error

    def __getitem__(self, rows: slice) -> np.ndarray:
        first, stop, step = rows.indices(len(self))
        if step != 1:
            raise IndexError("rows are read one after the other")
        n, n_t = max(stop - first, 0), self.shape[1]
        offset = (self._first + first) * n_t * np.dtype(np.float32).itemsize
        return np.fromfile(self._folder / FILE, np.float32, n * n_t, offset=offset).reshape(n, n_t)

    def part(self, rows: slice) -> Snapshots:
        """These rows alone, still on the disk; to be read only."""
        part = object.__new__(Snapshots)
        part._folder, part._first, part._blocks = self._folder, self._first + rows.start, []
        part.shape = (rows.stop - rows.start, self.shape[1])
        return part

    def at(self, points: np.ndarray) -> np.ndarray:
        """All rows at a few sample indices, shape (n, len(points)), double precision."""
        return np.vstack([rows[:, points].astype(float) for rows in self.blocks()])

    def blocks(self) -> Iterator[np.ndarray]:
        """All rows, some hundred at a time."""
        for first in range(0, len(self), READ):
            yield self[first : first + READ]
