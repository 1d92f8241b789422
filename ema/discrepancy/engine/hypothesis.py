"""Parameters and causes as values, and what the engine asks of a plant with its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Point = Mapping[str, float]  # values of parameters by name; what is not named is neutral


@dataclass(frozen=True)
class Parameter:
    """One number of a fault or a cause.

    Attributes
    ----------
    low, high : float
        What is credible.
    usual : float
        How far from `neutral` it usually is, where it is not neutral.
    """

    name: str
    low: float
    high: float
    usual: float
    neutral: float = 0.0


@dataclass(frozen=True)
class Cause:
    """Something that the simulation may lack, with the prior probability that it is there."""

    name: str
    parameters: tuple[Parameter, ...]
    prior: float


class Block(NamedTuple):
    """Features of one part of a record; blocks of one kind have the same noise."""

    at: slice
    kind: int


class Problem(Protocol):
    """A plant with its record."""

    @property
    def measured(self) -> Array:
        """Features of the record, shape (n_features,)."""
        ...

    @property
    def blocks(self) -> Sequence[Block]:
        """Parts of the record, which cover all features."""
        ...

    @property
    def floors(self) -> Array:
        """Standard deviations that two honest simulations of one law may differ by, (n_features,)."""
        ...

    @property
    def grids(self) -> int:
        """Grids of integration that take turns with the seeds of `records`; blocks of one record have the same."""
        ...

    @property
    def faults(self) -> Sequence[Parameter]:
        """Parameters that are free in every hypothesis, each there or not."""
        ...

    def records(self, points: Sequence[Point], seeds: range) -> Array:
        """Features of simulated records, (n_points, n_seeds, n_features); all points share the seeds."""
        ...
