"""What alarms hear besides estimates: what operators do to them, and how warm the windings are."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import NamedTuple, Protocol, TypeVar


class Action(IntEnum):
    """Numbers as on the bus."""

    ACK = 1  # seen
    CLEAR = 2  # give up one whose condition has gone
    SHELVE = 3  # out of sight for a while
    UNSHELVE = 4


class Command(NamedTuple):
    """One action, for one alarm; `actuator` is None for an alarm of the monitor. `duration` is of shelving. [s]"""

    t_ns: int
    action: Action
    actuator: int | None
    cause: str
    duration: float = 0.0


class Warmth(NamedTuple):
    """Temperature of an actuator's winding, as it says. [°C]"""

    t_ns: int
    actuator: int
    temp_w: float


Heard = Command | Warmth


class _Timed(Protocol):
    @property
    def t_ns(self) -> int: ...


T = TypeVar("T", bound=_Timed)


def in_order(heard: Iterable[Heard], items: Iterable[T]) -> Iterator[T | Heard]:
    """Items in their order, each after what was heard up to its time: the same live and from a log."""
    waiting: deque[Heard] = deque(sorted(heard, key=lambda one: one.t_ns))
    for item in items:
        while waiting and waiting[0].t_ns <= item.t_ns:
            yield waiting.popleft()
        yield item
    yield from waiting
