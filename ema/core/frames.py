"""Raw CAN frames as numpy records: what the bus yields, the log stores and replay feeds back."""

from __future__ import annotations

from enum import IntFlag

import numpy as np

MAX_DATA = 64
FRAME_DTYPE = np.dtype(
    [
        ("t_ns", "<u8"),  # reception time, ns since the Unix epoch
        ("id", "<u4"),  # arbitration identifier without flags, 11 or 29 bits
        ("flags", "u1"),  # FrameFlag bits
        ("length", "u1"),  # bytes of `data` that count, 0…64
        ("data", "u1", (MAX_DATA,)),  # zero beyond `length`
    ]
)


class FrameFlag(IntFlag):
    """What else is known of a frame besides identifier and payload."""

    EXTENDED = 1  # 29-bit identifier
    REMOTE = 2  # remote transmission request
    ERROR = 4  # error frame of the controller, not traffic
    FD = 8
    BRS = 16  # bit-rate switch
    ESI = 32  # error state indicator
    TX = 64  # sent by this process, not received


def empty(count: int) -> np.ndarray:
    """Zeroed frames, shape (count,), dtype FRAME_DTYPE."""
    return np.zeros(count, FRAME_DTYPE)


def pack(frames: np.ndarray) -> bytes:
    """Bytes of a batch of frames, FRAME_DTYPE.itemsize each."""
    return np.ascontiguousarray(frames, FRAME_DTYPE).tobytes()


def unpack(raw: bytes) -> np.ndarray:
    """Frames from `pack`ed bytes; ValueError when the bytes are not a whole number of frames."""
    return np.frombuffer(raw, FRAME_DTYPE)
