"""Which frames of a log take part, and as what: filters as candump knows them, identifiers renamed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ema.core.errors import LogError
from ema.core.frames import FrameFlag
from ema.log.reader import FrameBatch

_FILTER = re.compile(r"(~?)([0-9A-Fa-f]{1,8})(?::([0-9A-Fa-f]{1,8})|-([0-9A-Fa-f]{1,8}))?")
_NOT_TRAFFIC = int(FrameFlag.ERROR | FrameFlag.REFUSED)


class IdFilter(NamedTuple):
    """Identifiers `low`…`high` after masking, or, inverted, all others."""

    low: int
    high: int
    mask: int
    inverted: bool

    @classmethod
    def parse(cls, text: str) -> IdFilter:
        """``18A``, ``100-1FF`` or ``8B230000:1FFF0000`` (value and mask), hexadecimal; ``~`` before it inverts."""
        match = _FILTER.fullmatch(text)
        if match is None:
            raise LogError(f"filter {text!r} is not ID, ID-ID or ID:MASK in hexadecimal digits (~ inverts)")
        inverted, first, mask, last = match.groups()
        low = int(first, 16)
        if mask:
            return cls(low & int(mask, 16), low & int(mask, 16), int(mask, 16), bool(inverted))
        return cls(low, int(last, 16) if last else low, 0xFFFFFFFF, bool(inverted))

    def matches(self, ids: np.ndarray) -> np.ndarray:
        """Which identifiers pass, shape (n,)."""
        masked = ids & self.mask
        inside: np.ndarray = (masked >= self.low) & (masked <= self.high)
        return ~inside if self.inverted else inside


class Selection(NamedTuple):
    """What of a log takes part.

    Attributes
    ----------
    ids : filters
        A frame passes when one filter that is not inverted matches (or there is none), and all inverted ones do.
    buses : names
        Buses in the log; empty: all.
    renamed : mapping of identifier to identifier
    """

    ids: tuple[IdFilter, ...] = ()
    buses: tuple[str, ...] = ()
    renamed: dict[int, int] = {}  # noqa: RUF012

    def apply(self, batches: Iterable[FrameBatch]) -> Iterator[FrameBatch]:
        """The chosen frames, without error frames and those that message authentication has refused."""
        for bus, frames in batches:
            if self.buses and bus not in self.buses:
                continue
            keep = (frames["flags"] & _NOT_TRAFFIC) == 0
            wanted = [f.matches(frames["id"]) for f in self.ids if not f.inverted]
            if wanted:
                keep &= np.logical_or.reduce(wanted)
            for unwanted in (f for f in self.ids if f.inverted):
                keep &= unwanted.matches(frames["id"])
            chosen = frames[keep]
            if self.renamed and len(chosen):
                chosen = chosen.copy()
                ids = chosen["id"].copy()
                for old, new in self.renamed.items():
                    chosen["id"][ids == old] = new
            if len(chosen):
                yield FrameBatch(bus, chosen)
