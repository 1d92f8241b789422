"""From a set of causes to its neighbours, as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .hypothesis import Cause, Hypothesis, Point


@dataclass(frozen=True)
class Move:
    """A set of causes to be looked into, and where fits of it begin.

    `kind` tells where it comes from: a cause added, dropped or swapped for another; `instead` begins without the faults
    that the cause can be taken for.
    """

    kind: Literal["add", "drop", "swap", "instead"]
    causes: tuple[str, ...]
    start: Point
    cause: str

    @property
    def key(self) -> frozenset[str]:
        """The set of causes."""
        return frozenset(self.causes)


def moves(leader: Hypothesis, causes: Sequence[Cause], at_most: int) -> list[Move]:
    """All neighbours of a leader with no more than `at_most` causes.

    A cause begins at its own starts, or where first order puts it (an empty start).
    """
    known = {cause.name: cause for cause in causes}
    found: list[Move] = []
    for name in leader.causes:
        rest = tuple(n for n in leader.causes if n != name)
        gone = {p.name for p in known[name].parameters}
        found.append(Move("drop", rest, {n: x for n, x in leader.point.items() if n not in gone}, name))
    for cause in causes:
        if cause.name in leader.causes:
            continue
        for start in ({}, *cause.starts):
            if len(leader.causes) < at_most:
                added = (*leader.causes, cause.name)
                found.append(Move("add", added, {**leader.point, **start}, cause.name))
                faults = dict.fromkeys(cause.stands_for, 0.0)
                if any(leader.point.get(name, 0.0) for name in faults):
                    found.append(Move("instead", added, {**leader.point, **faults, **start}, cause.name))
            for name in leader.causes:
                gone = {p.name for p in known[name].parameters}
                point = {n: x for n, x in leader.point.items() if n not in gone}
                others = tuple(n for n in leader.causes if n != name)
                found.append(Move("swap", (*others, cause.name), {**point, **start}, cause.name))
    return found
