"""What every bus looks like from here: batches of frames in, batches out, and counters that tell what went wrong."""

from __future__ import annotations

import socket
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ema.core.closing import Closing
from ema.core.frames import FrameFlag
from ema.core.status import BusState

MAX_BATCH = 512  # frames read at once
RECEIVE_BUFFER = 8 << 20  # asked for; the kernel doubles it: 22 000 CAN FD frames, 3 s of six actuators [B]
BYTES_PER_FRAME = 766  # of the receive buffer, for a CAN FD frame (measured: the default of 212 992 B held 278)
_SO_RCVBUFFORCE = 33  # asm-generic/socket.h; Python's socket module does not name it
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


class Port(Closing):
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
        self._bus_state = BusState.ACTIVE
        self._flooded = False
        self._events: list[str] = []

    @property
    def bus_state(self) -> BusState:
        """As the controller or the interface tells it."""
        return self._bus_state

    @property
    def flooded(self) -> bool:
        """Whether others send so much that it is in the way of what is wanted."""
        return self._flooded

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


def ask_for_buffer(sock: socket.socket, size: int) -> str | None:
    """Ask the kernel for a receive buffer of `size` bytes; what to do when it grants less, else None."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, size)  # beyond rmem_max; needs CAP_NET_ADMIN
    except PermissionError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
    granted = sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    if granted >= 2 * size:
        return None
    return (
        f"receive buffer of {granted} B instead of {2 * size} B, about {granted // BYTES_PER_FRAME} frames: "
        f"set net.core.rmem_max = {size} (90-ema-can.conf)"
    )


def passes(frames: np.ndarray, filters: Filters) -> np.ndarray:
    """Whether the kernel would let each frame through, shape (n,): where there is no kernel to do it."""
    agrees = np.zeros(frames.size, bool)
    for frame_id, mask in filters:
        agrees |= (frames["id"] ^ frame_id) & mask == 0
    kind = frames["flags"] & (FrameFlag.EXTENDED | FrameFlag.REMOTE)
    return agrees & (kind == FrameFlag.EXTENDED)
