"""The four bytes every frame begins with: AUTOSAR E2E Profile 5 (CRC, counter) and a sequence number's high byte."""

from __future__ import annotations

from typing import Any

import numpy as np

HEADER_SIGNALS = ("crc", "counter", "sequence_high")
N_SEQUENCES = 1 << 16


def sequence(frames: np.ndarray) -> np.ndarray:
    """Running sequence numbers 0…65535, shape of `frames`: the E2E counter is the low byte."""
    low, high = frames["data"][..., 2], frames["data"][..., 3]
    return low | high.astype(np.uint16) << 8


def ahead(sequence: Any, of: Any) -> Any:
    """How far `sequence` is ahead of another, −32768…32767, across the wrap."""
    return (sequence - of + 0x8000) % N_SEQUENCES - 0x8000
