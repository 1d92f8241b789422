"""Pools of seeds: runs that whiten, those that predict and those that give directions are never the same."""

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

    PREDICT = 2
    COLUMN = 4


class OwnRecordsError(ValueError):
    """Runs were to be judged by a whitening that was made of them."""


def seeds(pool: Pool, n: int) -> range:
    """The first `n` seeds of a pool."""
    return range(pool * SIZE, pool * SIZE + n)


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


def simulate(problem: Problem, points: Sequence[Point], pool: Pool, n: int) -> list[Simulated]:
    """Records of several points, with the same seeds; what honest simulations may differ by is part of their noise."""
    of = seeds(pool, n)
    floor = problem.floors * np.array([np.random.default_rng(seed).standard_normal(len(problem.floors)) for seed in of])
    return [Simulated(features + floor, of, problem.grids) for features in problem.records(points, of)]
