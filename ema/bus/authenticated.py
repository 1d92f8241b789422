"""A port whose frames are sealed on the way out and verified on the way in."""

from __future__ import annotations

import time

import numpy as np

from .authentication import Sealer, Verifier
from .codec import Codec
from .port import Port


class AuthenticatedPort(Port):
    """Another port with message authentication; takes it over and closes it."""

    def __init__(self, port: Port, codec: Codec, key: bytes):
        super().__init__(port.name)
        self.choice = f"{port.choice}; frames are authenticated"
        self.counters = port.counters
        self._port = port
        self._sealer, self._verifier = Sealer(codec, key), Verifier(codec, key)

    def read(self, timeout: float) -> np.ndarray:
        """See Port; those that are not genuine are marked FrameFlag.REFUSED."""
        return self._verifier.feed(self._port.read(timeout), time.time_ns())

    def write(self, frames: np.ndarray) -> int:
        """See Port; the seals go out as well and are not counted in the answer."""
        n_sent = self._port.write(frames)
        seals = self._sealer.add(frames[:n_sent], time.time_ns())
        if seals.size:
            self._port.write(seals)
        return n_sent

    def take_events(self) -> list[str]:
        """See Port."""
        return self._port.take_events()

    def close(self) -> None:
        """See Port."""
        self._port.close()
