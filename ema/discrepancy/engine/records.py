"""Pools of seeds: runs that whiten, predict, test or give columns are never the same runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .hypothesis import Array, Point, Problem

SIZE = 1_000_000  # seeds of a pool


class Pool(IntEnum):
    """What a simulated record is used for."""

    WHITEN = 1
    PREDICT = 2
    TEST = 3
    COLUMN = 4


class OwnRecordsError(ValueError):
    """Runs were to be judged by a whitening that was made of them."""


def seeds(pool: Pool, n: int, first: int = 0) -> range:
    """`n` seeds of a pool, from its `first` on."""
    if first + n > SIZE:
        raise ValueError(f"{first + n} seeds of pool {pool.name}: there are {SIZE}")
    return range(pool * SIZE + first, pool * SIZE + first + n)


@dataclass(frozen=True)
class Simulated:
    """Records of one point: features (n_seeds, n_features) and the seeds they were made with.

    `grids` grids take turns with the seeds: what a simulation rounds is alike in all blocks of records of one grid.
    """

    features: Array
    seeds: range
    grids: int = 1

    @property
    def grid(self) -> NDArray[np.int64]:
        """Which grid each record has, (n_seeds,)."""
        return np.arange(len(self.features)) % self.grids

    def refuse_shared(self, other: range) -> None:
        """OwnRecordsError where records were made with seeds of `other`."""
        if max(self.seeds.start, other.start) < min(self.seeds.stop, other.stop):
            raise OwnRecordsError(f"seeds {self.seeds} share runs with {other}: take another pool")


def simulated(problem: Problem, points: Sequence[Point], pool: Pool, n: int, first: int = 0) -> list[Simulated]:
    """Records of several points, with the same seeds; what honest simulations may differ by is part of their noise."""
    of = seeds(pool, n, first)
    floor = problem.floors * np.array([np.random.default_rng(seed).standard_normal(len(problem.floors)) for seed in of])
    return [Simulated(features + floor, of, problem.grids) for features in problem.records(points, of)]
