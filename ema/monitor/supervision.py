"""What the configuration promises, and since when it does not happen. Pure: the caller hands in the time.

A promise is kept by being seen; one that is not seen for its deadline has lapsed. What rests on something that has
lapsed itself says nothing new: of a silent actuator nobody need be told that its motion is missing too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from ema.core.status import Lapse

LONGEST_STEP = 1.0  # between two looks; what this process has slept through is nobody else's silence [s]


class Promise(NamedTuple):
    """Something that happens again and again as long as all is well.

    Attributes
    ----------
    lapse : Lapse
        What it is called when it does not.
    actuator : int or None
        Whom it concerns; None: all.
    subject : str
        What of it: an identifier, a channel; empty where the lapse says all.
    """

    lapse: Lapse
    actuator: int | None = None
    subject: str = ""


@dataclass
class _Kept:
    deadline: float
    rests_on: tuple[Promise, ...]
    seen: float | None = None  # when last, in supervised time [s]
    since: float = 0.0  # from when on it can be expected [s]
    failed: bool = False


class Change(NamedTuple):
    """A promise that has lapsed, or is kept again; `lasted`: for how long it was not. [s]"""

    promise: Promise
    lapsed: bool
    lasted: float


@dataclass
class Supervisor:
    """A table of promises with their deadlines, looked at again and again.

    Attributes
    ----------
    lapsed : set of Promise
        At the last look, without those that rest on another one of them.
    awaited : bool
        Whether something promised was never seen, though its time is not yet over.
    """

    lapsed: set[Promise] = field(default_factory=set)
    awaited: bool = True
    _table: dict[Promise, _Kept] = field(default_factory=dict)
    _broken: set[Promise] = field(default_factory=set)
    _lapsed_at: dict[Promise, float] = field(default_factory=dict)
    _time: float = 0.0  # supervised so far [s]
    _looked: float | None = None

    def promise(self, promise: Promise, deadline: float, rests_on: Iterable[Promise] = ()) -> None:
        """Expect to see it at least every `deadline` [s]. Infinite: only `fail` says otherwise."""
        self._table[promise] = _Kept(deadline, tuple(rests_on), since=self._time)

    def keep(self, promise: Promise) -> None:
        """It was seen."""
        kept = self._table[promise]
        kept.seen, kept.failed = self._time, False

    def fail(self, promise: Promise) -> None:
        """It is known not to happen, until it is seen again."""
        self._table[promise].failed = True

    def show(self, states: Mapping[Promise, bool]) -> None:
        """Promises of which is known at any time whether they are kept."""
        for promise, kept in states.items():
            (self.keep if kept else self.fail)(promise)

    def advance(self, now: float) -> None:
        """It is `now`, a monotonic time [s]: what is seen from here on is seen now."""
        if self._looked is not None:
            self._time += min(now - self._looked, LONGEST_STEP)
        self._looked = now

    def look(self) -> list[Change]:
        """What has changed since the last look."""
        broken = {promise for promise, kept in self._table.items() if self._is_broken(kept)}
        self._begin_anew(self._broken - broken)
        broken = {promise for promise in broken if self._is_broken(self._table[promise])}
        told = {promise for promise in broken if broken.isdisjoint(self._table[promise].rests_on)}
        self._broken = broken
        begun, over = told - self.lapsed, self.lapsed - told
        for promise in begun:
            self._lapsed_at[promise] = self._time
        changes = [Change(promise, True, 0.0) for promise in sorted(begun, key=_order)]
        changes += [
            Change(promise, False, self._time - self._lapsed_at[promise])
            for promise in sorted(over - broken, key=_order)  # the rest is not kept again, but explained by another
        ]
        self.lapsed = told
        self.awaited = any(kept.seen is None and kept.deadline < inf for kept in self._table.values())
        return changes

    @property
    def ordered(self) -> list[Promise]:
        """What has lapsed, the gravest first."""
        return sorted(self.lapsed, key=_order)

    @property
    def gravest(self) -> Promise | None:
        """The first thing to tell a person."""
        return min(self.lapsed, key=_order, default=None)

    def _begin_anew(self, kept_again: set[Promise]) -> None:
        """What rests on it could not happen meanwhile, and has its whole deadline from now on."""
        for kept in self._table.values():
            if not kept_again.isdisjoint(kept.rests_on):
                kept.since = self._time

    def _is_broken(self, kept: _Kept) -> bool:
        last = kept.since if kept.seen is None else max(kept.since, kept.seen)
        return kept.failed or self._time - last > kept.deadline


def _order(promise: Promise) -> tuple[int, int, str]:
    return promise.lapse, -1 if promise.actuator is None else promise.actuator, promise.subject
