"""Whether another monitor on the bus estimates the faults of the same actuators. Pure: the caller hands in the time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import Check, Receiver

_MONITOR = "Monitor"  # sender in the DBC
_ESTIMATES = "Estimate"
_FID = np.uint32(0x7F << 19)  # of the identifier: the source
_WHOLE = (Check.OK, Check.SOME_LOST, Check.REORDERED, Check.REPEATED, Check.WRONG_COUNTER)  # no matter in which order


class Other(NamedTuple):
    """Another monitor, as far as it is known: which of our actuators it watches, and for how long it has run [s]."""

    actuators: frozenset[int]
    uptime: int

    def __str__(self) -> str:
        numbers = ", ".join(map(str, sorted(self.actuators)))
        since = f", running for {self.uptime} s," if self.uptime else ""
        return f"another monitor{since} watches actuator {numbers}"


class Presence:
    """Listens for other monitors.

    Parameters
    ----------
    codec : Codec
    watched : numbers
        Actuators that this monitor watches.
    """

    def __init__(self, codec: Codec, watched: frozenset[int]):
        self._codec, self._watched = codec, watched
        names = [name for name, m in codec.messages.items() if m.sender == _MONITOR]
        self._receiver = Receiver(codec, names)
        self._fid = np.uint32(codec.messages["Heartbeat"].frame_id) & _FID
        self.timeout = codec.messages["Heartbeat"].timeout  # of another's sign of life [s]
        self._heard: dict[int, float] = {}  # when last a sign of another was heard, by actuator [s]
        self._uptime = 0

    def without(self, frames: np.ndarray, now: float) -> np.ndarray:
        """Take what other monitors sent out of a batch, shape (n,), received at `now` [s]; the rest of it."""
        theirs = (frames["id"] & _FID) == self._fid
        if not theirs.any():
            return frames
        own = frames[theirs]
        whole = np.isin(self._receiver.check(own), _WHOLE)
        for message, part in self._codec.split(own[whole]):
            if message.name == "Heartbeat":
                self._uptime = int(message.decode(part)["uptime"][-1])
            elif message.name == "Supervision":
                bits = int(np.bitwise_or.reduce(message.decode(part)["watched"]))
                self._note({number for number in self._watched if bits >> number & 1}, now)
            elif message.name.startswith(_ESTIMATES):
                self._note(set(identifiers.actuator(part["id"]).tolist()) & self._watched, now)
        return frames[~theirs]

    def other(self, now: float) -> Other | None:
        """The other monitor, if one was heard within its time-out."""
        actuators = frozenset(number for number, at in self._heard.items() if now - at <= self.timeout)
        return Other(actuators, self._uptime) if actuators else None

    def _note(self, actuators: set[int], now: float) -> None:
        self._heard.update(dict.fromkeys(actuators, now))
