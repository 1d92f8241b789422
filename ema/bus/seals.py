"""Message authentication of frames: AES-CMAC of 64 bits, fresh by session and counter (after AUTOSAR SecOC).

A frame of 64 bytes has no room for a MAC, so MACs travel in frames of their own (`ActuatorSeal`, `MonitorSeal`,
`TesterSeal`): up to five frames of one identifier with consecutive counters, a MAC for each, so that one lost frame
costs no other. The seal's own MAC says that all it states is genuine; then each frame it names is tried once, under the
number it names it by.

The freshness of a frame is (session, counter). A session begins when its sender starts and when it is asked to (a
challenge); its number is never used again (`sessions`). The counter is the frame's sequence number, counted on beyond
16 bits. Clocks play no part.
"""

from __future__ import annotations

import struct

import numpy as np

from ema.core.frames import FRAME_DTYPE

from .codec import Codec, Message

PER_SEAL = 5
HEADER = 4  # bytes of the E2E header, which no MAC of these covers: it is filled last
ROW = FRAME_DTYPE.itemsize
DATA = FRAME_DTYPE.fields["data"][1]  # type: ignore[index]
_FRAME, _SEAL, _SESSION = b"\x01", b"\x02", b"\x03"  # what a MAC is of, so that none passes for another
_FRESHNESS = struct.Struct(">HII")


def of_frame(data_id: int, session: int, counter: int, payload: bytes) -> bytes:
    """What a frame's MAC is made over."""
    return _FRAME + _FRESHNESS.pack(data_id, session, counter) + payload


def of_seal(payload: bytes) -> bytes:
    """What a seal's own MAC is made over."""
    return _SEAL + payload


def of_session(payload: bytes) -> bytes:
    """What the MAC of the answer to a challenge is made over."""
    return _SESSION + payload


def covered(codec: Codec, kind: str, mac: str) -> slice:
    """Which bytes of a message are under its own MAC, the signal `mac`: from the header to it."""
    message: Message = next(m for m in codec.messages.values() if m.name.endswith(kind))
    return slice(HEADER, message.fields[mac].byte)


def rows(frames: np.ndarray) -> list[bytes]:
    """Each frame as bytes."""
    raw = np.ascontiguousarray(frames).tobytes()
    return [raw[n : n + ROW] for n in range(0, len(raw), ROW)]
