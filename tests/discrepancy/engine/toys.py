"""Toy plants: a few features that faults and causes move, with noise of a known form, in milliseconds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ema.discrepancy.engine.hypothesis import Block, Cause, Parameter, Point
from ema.discrepancy.engine.statistic import Whitening

INF = float("inf")


def parameter(name: str, usual: float = 3.0, low: float = -100.0, high: float = 100.0) -> Parameter:
    return Parameter(name, low, high, usual)


@dataclass
class Toy:
    """A record of `columns` times parameters, bent by `bend`, with correlated noise.

    Attributes
    ----------
    columns : dict of arrays, shape (n_features,)
        Response per unit of each parameter.
    truth : Point
    bend : callable, optional
        What a point adds to the features beyond that.
    law : array, optional
        What the record holds that no hypothesis says.
    of_grid : array, shape (grids, n_features), optional
        What a grid of integration adds to every record made with it.
    """

    columns: dict[str, np.ndarray]
    faults: Sequence[Parameter]
    causes: Sequence[Cause]
    truth: Point = field(default_factory=dict)
    seed: int = 0
    bend: Callable[[Point], np.ndarray] | None = None
    law: np.ndarray | float = 0.0
    noise: float = 1.0
    grids: int = 1
    of_grid: np.ndarray | float = 0.0

    def __post_init__(self) -> None:
        self.n = len(next(iter(self.columns.values())))
        half = self.n // 2
        self.blocks = (Block(slice(0, half), 0), Block(slice(half, self.n), 1))
        self.floors = np.full(self.n, 1e-3)
        self.mixing = np.eye(self.n) + 0.3 * np.eye(self.n, k=1)
        rng = np.random.default_rng([self.seed, 99])
        self.measured = self.mean(self.truth) + self._noise(rng) + self.law

    def _noise(self, rng: np.random.Generator) -> np.ndarray:
        return np.asarray(self.noise * (self.mixing @ rng.standard_normal(self.n)))

    def mean(self, point: Point) -> np.ndarray:
        linear = sum((point[name] * column for name, column in self.columns.items() if name in point), np.zeros(self.n))
        return np.asarray(linear if self.bend is None else linear + self.bend(point))

    def records(self, points: Sequence[Point], seeds: range) -> np.ndarray:
        noise = np.array([self._noise(np.random.default_rng(seed)) for seed in seeds])
        noise = noise + (self.of_grid[np.arange(len(seeds)) % self.grids] if self.grids > 1 else 0.0)
        return np.array([self.mean(point) + noise for point in points])

    def whitening(self, seeds: range = range(0)) -> Whitening:
        """By the noise as it is, as if made of the runs of `seeds`."""
        cov = self.noise**2 * self.mixing @ self.mixing.T + np.diag(self.floors**2)
        sd = np.sqrt(np.diag(cov))
        of = {b.kind: np.linalg.cholesky((cov / np.outer(sd, sd))[b.at, b.at]) for b in self.blocks}
        roots = {kind: lambda x, L=L: np.linalg.solve(L, x.T).T for kind, L in of.items()}
        return Whitening(sd, roots, self.blocks, seeds)


def plant(
    n_faults: int, names: Sequence[str], n: int = 24, seed: int = 0, usual: float = 3.0, **changed: object
) -> Toy:
    """Faults and causes of one parameter each, in random directions of about unit length."""
    rng = np.random.default_rng(seed)
    faults = [parameter(f"k{j + 1}", low=0.0) for j in range(n_faults)]
    causes = [Cause(name, (parameter(f"{name}.size", usual, -1000.0, 1000.0),), prior=0.1) for name in names]
    everything = [*faults, *(p for c in causes for p in c.parameters)]
    columns = {p.name: rng.standard_normal(n) / np.sqrt(n) * 3.0 for p in everything}
    return Toy(columns, faults, causes, **{"seed": seed, **changed})  # type: ignore[arg-type]
