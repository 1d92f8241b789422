"""Raw frames to and from messages: a batch is at most 512 frames and 0.25 s."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator
from typing import Any

import numpy as np

from ema.core import frames as raw

MAX_COUNT = 512
MAX_SPAN_NS = 250_000_000


class Batcher:
    """Collects the frames of one bus and cuts them into messages."""

    def __init__(self, bus: str):
        self._bus = bus
        self._parts: list[np.ndarray] = []
        self._count = 0
        self._first_ns = 0

    def add(self, frames: np.ndarray) -> Iterator[dict[str, Any]]:
        """Messages that became complete by these frames (shape (n,), FRAME_DTYPE; the caller may reuse the array)."""
        if len(frames) == 0:
            return
        if self._count == 0:
            self._first_ns = int(frames["t_ns"][0])
        self._parts.append(frames.copy())
        self._count += len(frames)
        if self._count >= MAX_COUNT or not _within(self._first_ns, frames["t_ns"]).all():
            yield from self._cut(keep_last=True)

    def flush(self) -> Iterator[dict[str, Any]]:
        """The frames that wait for their batch to be complete."""
        yield from self._cut(keep_last=False)

    def _cut(self, keep_last: bool) -> Iterator[dict[str, Any]]:
        if self._count == 0:
            return
        frames = raw.joined(self._parts) if len(self._parts) > 1 else self._parts[0]
        begin = 0
        while begin < len(frames):
            window = frames[begin : begin + MAX_COUNT]
            outside = np.flatnonzero(~_within(int(window["t_ns"][0]), window["t_ns"]))
            count = int(outside[0]) if len(outside) else len(window)
            complete = len(outside) > 0 or count == MAX_COUNT
            if keep_last and not complete:
                break
            yield pack(self._bus, window[:count])
            begin += count
        rest = frames[begin:]
        self._parts = [rest] if len(rest) else []
        self._count = len(rest)
        self._first_ns = int(rest["t_ns"][0]) if len(rest) else 0


def _within(first_ns: int, t_ns: np.ndarray) -> np.ndarray:
    """Which times are so near to the first that one batch may hold both (time may also run backwards)."""
    return np.abs(t_ns.astype(np.int64) - first_ns) < MAX_SPAN_NS


def pack(bus: str, frames: np.ndarray) -> dict[str, Any]:
    """Message content of a batch."""
    return {
        "bus": bus,
        "count": len(frames),
        "first_ns": int(frames["t_ns"][0]),
        "frames": base64.b64encode(raw.pack(frames)).decode("ascii"),
    }


def unpack(content: dict[str, Any]) -> np.ndarray:
    """Frames of a message, shape (count,); ValueError when they are not what the message says."""
    try:
        frames = raw.unpack(base64.b64decode(content["frames"], validate=True))
    except (KeyError, TypeError, AttributeError, binascii.Error) as error:
        raise ValueError("frames are not base64") from error
    if len(frames) != content.get("count") or (frames["length"] > raw.MAX_DATA).any():
        raise ValueError("frames do not match their count or length")
    return frames
