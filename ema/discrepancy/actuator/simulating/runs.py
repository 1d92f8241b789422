"""Simulated runs of a record's cycles: what one is asked by, and those that were simulated already."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ema.core.records import Array
from ema.models import parts

MOST = 12_000  # runs that are remembered: some 200 MB


class Asked(NamedTuple):
    """One run: what it is simulated with.

    Attributes
    ----------
    point : frozenset
        Names and values of all that is not neutral.
    cycle, seed : int
    dt : float
        Integration step. [s]
    late : int
        Samples by which the command is late.
    zero : float, optional
        By how much the zeros of rotor and user are taken to lie apart. [rad]
    """

    point: frozenset[tuple[str, float]]
    cycle: int
    seed: int
    dt: float
    late: int
    zero: float | None

    @property
    def alike(self) -> tuple[float, int, bool, int]:
        """What to sort by: runs of the same equations and clock share batches of lanes, of one seed their noise."""
        effects = {name.split(".")[0] for name, _ in self.point if "." in name}
        return self.dt, parts.needed(effects), "clock_skew" in effects, self.seed


@dataclass(frozen=True)
class Runs:
    """Simulated runs of one motion: features (n, n_features) and envelopes (n, n_times / ENVELOPE_STEP)."""

    features: Array
    envelopes: Array


@dataclass
class Work:
    """Runs that were asked for, those of them that had to be simulated, and the integration steps these took."""

    asked: int = 0
    simulated: int = 0
    steps: int = 0


class Memory:
    """Runs by what they were asked by, the longest unused forgotten first.

    A run is a function of what it is asked by. All points share seeds, so a search comes back to the same runs: to the
    point it stands at whenever columns are taken there, to the beginning with every path.
    """

    def __init__(self, most: int = MOST):
        self.most = most
        self._kept: OrderedDict[Asked, tuple[Array, Array]] = OrderedDict()

    def unknown(self, asked: Iterable[Asked]) -> list[Asked]:
        """Those that must be simulated, each once, in the order in which they were asked."""
        return [key for key in dict.fromkeys(asked) if key not in self._kept]

    def keep(self, asked: Sequence[Asked], runs: Runs) -> None:
        """Remember what was simulated."""
        for key, features, envelope in zip(asked, runs.features, runs.envelopes, strict=True):
            self._kept[key] = features.copy(), envelope.copy()

    def recall(self, asked: Sequence[Asked]) -> Runs:
        """Runs in the order in which they were asked, all of them known; then no more than `most` are kept."""
        for key in asked:
            self._kept.move_to_end(key)
        found = [self._kept[key] for key in asked]
        while len(self._kept) > self.most:
            self._kept.popitem(last=False)
        features, envelopes = zip(*found, strict=True)
        return Runs(np.array(features), np.array(envelopes))
