"""Messages read of each channel against what the file says: by numbers that run through, by indexes, by the summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import NamedTuple


class Missing(NamedTuple):
    """Messages that were written and cannot be read. Times in ns, None where nothing tells."""

    topic: str
    n: int
    first_ns: int | None
    last_ns: int | None

    def __str__(self) -> str:
        start, end = (None if t is None else _moment(t) for t in (self.first_ns, self.last_ns))
        when = f" between {start} and {end}" if start and end else f" before {end}" if end else ""
        when = when or (f" after {start}" if start else "")
        return f"{self.n} message{'s' * (self.n != 1)} on {self.topic} missing{when}"


@dataclass
class _Gap:
    """Numbers low … high - 1 of a channel have not come, between two messages at these times."""

    low: int
    high: int
    first_ns: int | None
    last_ns: int


@dataclass
class _Channel:
    awaited: int = 1  # number of the next message
    numbered: bool = False
    seen: int = 0  # read, or left out on purpose
    last_ns: int | None = None
    gaps: list[_Gap] = field(default_factory=list)
    lost: list[tuple[int, int, int]] = field(default_factory=list)  # count, first and last time

    @property
    def n_missing(self) -> int:
        return sum(gap.high - gap.low for gap in self.gaps) + sum(count for count, _, _ in self.lost)


class Ledger:
    """One pass through a file.

    The writer numbers the messages of a channel from 1 on (`sequence` of MCAP). 0 is a log without numbers.
    """

    def __init__(self) -> None:
        self._channels: dict[int, _Channel] = {}
        self.out_of_order = False

    @property
    def channels(self) -> set[int]:
        """Channels of which anything was seen."""
        return set(self._channels)

    def take(self, channel: int, sequence: int, t_ns: int) -> None:
        """A message was read."""
        one = self._of(channel)
        one.seen += 1
        one.numbered |= sequence > 0
        if sequence > one.awaited:
            one.gaps.append(_Gap(one.awaited, sequence, one.last_ns, t_ns))
        elif 0 < sequence < one.awaited:
            self.out_of_order = True
            _fill(one.gaps, sequence)
        one.awaited = max(one.awaited, sequence + 1)
        one.last_ns = t_ns

    def leave(self, channel: int, count: int) -> None:
        """Messages are left out, since nobody asked for their time."""
        one = self._of(channel)
        one.seen += count
        one.awaited += count

    def lose(self, channel: int, t_ns: list[int]) -> None:
        """Messages of these times cannot be read."""
        if t_ns:
            one = self._of(channel)
            one.lost.append((len(t_ns), min(t_ns), max(t_ns)))
            one.awaited += len(t_ns)

    def again(self) -> None:
        """Another file begins within the file: its numbers begin again."""
        for one in self._channels.values():
            one.awaited, one.last_ns = 1, None

    def missing(self, topics: Mapping[int, str], said: Mapping[int, int]) -> list[Missing]:
        """All that is missing, where the summary says so many messages by channel."""
        found = []
        for channel in sorted(self._channels.keys() | said.keys()):
            one = self._of(channel)
            topic = topics.get(channel) or f"channel {channel}"
            found += [Missing(topic, *lost) for lost in one.lost]
            found += [Missing(topic, gap.high - gap.low, gap.first_ns, gap.last_ns) for gap in one.gaps]
            beyond = said.get(channel, 0) - one.seen - one.n_missing
            if beyond > 0:
                found.append(Missing(topic, beyond, one.last_ns if one.numbered else None, None))
        return found

    def surplus(self, said: Mapping[int, int]) -> int:
        """How many messages there are more than the summary says."""
        return sum(max(0, one.seen - said.get(channel, 0)) for channel, one in self._channels.items())

    def _of(self, channel: int) -> _Channel:
        return self._channels.setdefault(channel, _Channel())


def _fill(gaps: list[_Gap], number: int) -> None:
    """A number comes late: it is missing no longer."""
    for place, gap in enumerate(gaps):
        if gap.low <= number < gap.high:
            parts = [(gap.low, number), (number + 1, gap.high)]
            gaps[place : place + 1] = [_Gap(*part, gap.first_ns, gap.last_ns) for part in parts if part[0] < part[1]]
            return


def _moment(t_ns: int) -> str:
    try:
        return datetime.fromtimestamp(t_ns / 1e9, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    except (OverflowError, ValueError, OSError):
        return f"{t_ns} ns"
