"""How a tester's command is sent so that it is taken: also after an earlier call, and where keys are needed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from ema.core.errors import BusError

from . import identifiers
from .authenticated import AuthenticatedPort
from .codec import Codec
from .header import N_SEQUENCES
from .port import Port
from .protection import Sender

_ASKS_WITHIN = 0.5  # who listens looks at the bus every 50 ms, and asks a sender that it does not know at once [s]


class Commander:
    """Sends commands of one tester.

    Every command goes out twice, with numbers from the clock: to who has heard an earlier call, the first frame only
    says that there is a new sender. So what is commanded must be the same done once or twice.
    """

    def __init__(self, port: Port, codec: Codec):
        self._port, self._codec = port, codec
        self._sender = Sender()
        self._known: set[int] = set()

    def send(self, name: str, actuator: int, values: Mapping[str, Any]) -> None:
        """Send one command, a message of the DBC. BusError when the bus does not take it."""
        frames = np.repeat(self._codec.encode(name, actuator, values), 2)
        frame_id = identifiers.with_actuator(int(frames["id"][0]), actuator)
        if frame_id not in self._known:
            self._known.add(frame_id)
            self._sender.skip(frame_id, time.time_ns() // 10**6 % N_SEQUENCES)
        self._write(frames)
        if isinstance(self._port, AuthenticatedPort) and _asked(self._port):
            self._write(frames)  # what was sent before the answer has been refused

    def _write(self, frames: np.ndarray) -> None:
        if self._port.write(self._sender.protect(frames)) < frames.size:
            raise BusError("; ".join(self._port.take_events()) or f"bus {self._port.name} does not take frames")


def _asked(port: AuthenticatedPort) -> bool:
    """Whether it asks who this is, as it does when it has not heard of this tester before; it is answered."""
    before, end = port.n_answers, time.monotonic() + _ASKS_WITHIN
    while port.n_answers == before and time.monotonic() < end:
        port.read(0.05)
    return port.n_answers > before
