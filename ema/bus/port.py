"""What every bus looks like from here: batches of frames in, batches out, and counters that tell what went wrong."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

MAX_BATCH = 512  # frames read at once
Filters = Sequence[tuple[int, int]]  # (identifier, mask of the bits in which a frame has to agree with it)


@dataclass(slots=True)
class PortCounters:
    """What happened to frames at the interface itself, below any message."""

    n_received: int = 0
    n_sent: int = 0
    n_send_retries: int = 0  # the transmit queue was full and took the frame later
    n_send_failed: int = 0  # given up
    n_error_frames: int = 0  # from the CAN controller
    n_unreadable: int = 0  # not a CAN frame at all
    n_link_down: int = 0
    kernel_drops: int = 0  # the kernel's receive buffer was full


class Port(ABC):
    """An open bus.

    Attributes
    ----------
    name : str
        Interface and channel, as in ``udp_multicast:239.74.163.2``.
    choice : str
        One line for people: what was opened and why.
    counters : PortCounters
    """

    def __init__(self, name: str):
        self.name = name
        self.choice = name
        self.counters = PortCounters()
        self._events: list[str] = []

    @abstractmethod
    def read(self, timeout: float) -> np.ndarray:
        """Frames that have arrived, waiting up to `timeout` [s] for the first; shape (n,), n ≤ MAX_BATCH, FRAME_DTYPE.

        Empty after the time-out and while the link is down; never raises because of what is on the bus.
        """

    @abstractmethod
    def write(self, frames: np.ndarray) -> int:
        """Send frames in order; how many were taken. Never raises because of the state of the bus."""

    @abstractmethod
    def close(self) -> None:
        """Give the bus back."""

    def take_events(self) -> list[str]:
        """What happened to the link since the last call, one line each."""
        events, self._events = self._events, []
        return events

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
