"""What an operator may do to an alarm."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import Any, NamedTuple, Protocol, TypeVar


class Action(IntEnum):
    """Numbers as on the bus."""

    ACK = 1  # seen
    CLEAR = 2  # give up one whose condition has gone
    SHELVE = 3  # out of sight for a while
    UNSHELVE = 4


class Command(NamedTuple):
    """One of them, for one alarm; `actuator` is None for an alarm of the monitor. `duration` is of shelving. [s]"""

    t_ns: int
    action: Action
    actuator: int | None
    cause: str
    duration: float = 0.0


class _Timed(Protocol):
    @property
    def t_ns(self) -> int: ...


T = TypeVar("T", bound=_Timed)


def in_order(commands: Iterable[Command], items: Iterable[T]) -> Iterator[T | Command]:
    """Items in their order, each after the commands of its time and before: the same live and from a log."""
    waiting: list[Any] = sorted(commands, key=lambda command: command.t_ns)
    for item in items:
        while waiting and waiting[0].t_ns <= item.t_ns:
            yield waiting.pop(0)
        yield item
    yield from waiting
