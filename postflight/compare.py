"""Estimates made again beside those in the log, cycle by cycle."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ema.core.names import FAULTS

_OPEN = 2000  # estimates that may wait for their counterpart

Content = dict[str, Any]
_Key = tuple[int, str, int, int]


class Pair(NamedTuple):
    """One cycle by one method: what the log says, and what is said now; one of them may be missing."""

    actuator: int
    method: str
    cycle: int
    logged: Content | None
    again: Content | None

    @property
    def equal(self) -> bool:
        """Whether both are there and equal to the last bit."""
        return self.logged is not None and self.again is not None and _said(self.logged) == _said(self.again)

    @property
    def difference(self) -> np.ndarray:
        """k now less k logged, shape (6,); NaN where either is missing."""
        return _k(self.again) - _k(self.logged)


@dataclass
class Totals:
    """Of one actuator and method."""

    n_pairs: int = 0
    n_equal: int = 0
    n_only_logged: int = 0
    n_only_again: int = 0
    n_status: int = 0  # pairs whose status differs
    largest: np.ndarray = field(default_factory=lambda: np.zeros(len(FAULTS)))  # |Δk|
    squares: np.ndarray = field(default_factory=lambda: np.zeros(len(FAULTS)))
    n_squares: int = 0

    def add(self, pair: Pair) -> None:
        """Count one pair."""
        if pair.logged is None or pair.again is None:
            self.n_only_again += pair.logged is None
            self.n_only_logged += pair.again is None
            return
        self.n_pairs += 1
        self.n_equal += pair.equal
        self.n_status += pair.logged["status"] != pair.again["status"]
        difference = pair.difference
        if np.isfinite(difference).all():
            self.largest = np.maximum(self.largest, np.abs(difference))
            self.squares += difference**2
            self.n_squares += 1

    @property
    def rms(self) -> np.ndarray:
        """Root mean square of k now less k logged, shape (6,)."""
        return np.sqrt(self.squares / max(1, self.n_squares))


class Comparison:
    """Matches estimates as they come, in memory that does not grow.

    Parameters
    ----------
    on_pair : callable
        Gets every `Pair`.
    """

    def __init__(self, on_pair: Callable[[Pair], None] = lambda pair: None):
        self.totals: dict[tuple[int, str], Totals] = {}
        self._on_pair = on_pair
        self._open: OrderedDict[_Key, dict[str, Content]] = OrderedDict()

    def logged(self, content: Content) -> None:
        """An estimate in the log."""
        self._match(content, "logged")

    def again(self, content: Content) -> None:
        """An estimate made now."""
        self._match(content, "again")

    def finish(self) -> None:
        """Nothing more comes: what waits has no counterpart."""
        while self._open:
            self._close(*self._open.popitem(last=False))

    @property
    def n_different(self) -> int:
        """Estimates that are not equal or have no counterpart."""
        return sum(t.n_pairs - t.n_equal + t.n_only_logged + t.n_only_again for t in self.totals.values())

    @property
    def n_equal(self) -> int:
        """Estimates equal to the last bit."""
        return sum(t.n_equal for t in self.totals.values())

    def _match(self, content: Content, side: str) -> None:
        # the time too, because cycle numbers begin anew when an actuator restarts
        key = content["actuator"], content["method"], content["cycle"], content["t_ns"]
        sides = self._open.setdefault(key, {})
        sides[side] = content
        if len(sides) == 2:
            self._close(key, self._open.pop(key))
        elif len(self._open) > _OPEN:
            self._close(*self._open.popitem(last=False))

    def _close(self, key: _Key, sides: dict[str, Content]) -> None:
        pair = Pair(*key[:3], sides.get("logged"), sides.get("again"))
        self.totals.setdefault((pair.actuator, pair.method), Totals()).add(pair)
        self._on_pair(pair)


def _said(content: Content) -> Content:
    """What an estimate says; its age is that of its sending, which is not repeated."""
    return {name: value for name, value in content.items() if name != "age"}


def _k(content: Content | None) -> np.ndarray:
    if content is None:
        return np.full(len(FAULTS), np.nan)
    return np.array([np.nan if value is None else value for value in content["k"]], float)
