"""A log back onto a bus, in its own time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ema.bus.port import Port
from ema.log.reader import FrameBatch

from .pacing import Pace, merged

_TOGETHER = 0.0002  # frames due within this time are handed over at once [s]
_LATE_BINS = np.array([0.0005, 0.001, 0.002, 0.005, 0.01, 0.1, np.inf])  # upper limits [s]


@dataclass
class Replayed:
    """What a replay did."""

    n_sent: int = 0
    n_refused: int = 0  # by the bus
    n_unmapped: int = 0  # of a channel that has no bus
    duration: float = 0.0  # [s]
    latest: float = 0.0  # how much the latest frame sent was behind its time [s]
    late: np.ndarray = field(default_factory=lambda: np.zeros(len(_LATE_BINS), int))  # frames sent, by lateness

    def late_share(self, limit: float) -> float:
        """Share of frames sent more than `limit` [s] (one of 0.5, 1, 2, 5, 10, 100 ms) after their time."""
        return float(self.late[limit < _LATE_BINS].sum() / max(1, self.late.sum()))


class Replayer:
    """Sends frames at absolute deadlines, so that delays do not add up.

    Parameters
    ----------
    ports : mapping of bus name in the log to Port
        "" is the port of all names not given.
    pace : Pace
    stop : threading.Event
        Ends the replay early.
    clock : callable
        Monotonic time. [s]
    """

    def __init__(
        self,
        ports: Mapping[str, Port],
        pace: Pace,
        stop: threading.Event | None = None,
        clock: Callable[[], float] = time.monotonic,
    ):
        self._ports, self._pace, self._clock = ports, pace, clock
        self._stop = stop or threading.Event()
        self._begin: float | None = None
        self.done = Replayed()

    def run(self, batches: Iterable[FrameBatch]) -> Replayed:
        """Send everything once; call again to repeat."""
        self._pace.again()
        for traffic in merged(batches):
            ports = [self._ports.get(name, self._ports.get("")) for name in traffic.buses]
            due = self._pace.due(traffic.frames["t_ns"])
            at = 0
            while at < len(due) and not self._stop.is_set():
                now = self._wait(float(due[at]))
                end = max(at + 1, int(np.searchsorted(due, now + _TOGETHER, side="right")))
                self._send(ports, traffic.bus[at:end], traffic.frames[at:end], now - due[at:end])
                at = end
            if self._stop.is_set():
                break
        self.done.duration = self._clock() - self._begin if self._begin is not None else 0.0
        return self.done

    def _wait(self, due: float) -> float:
        """Wait until a deadline; the time by the replay's clock."""
        if self._begin is None:
            self._begin = self._clock()
        while (early := due - (self._clock() - self._begin)) > 1e-6 and not self._stop.wait(early):
            pass
        return self._clock() - self._begin

    def _send(self, ports: list[Port | None], bus: np.ndarray, frames: np.ndarray, lateness: np.ndarray) -> None:
        for index, port in enumerate(ports):
            own = frames[bus == index]
            if port is None:
                self.done.n_unmapped += len(own)
            elif len(own):
                sent = port.write(own)
                self.done.n_sent += sent
                self.done.n_refused += len(own) - sent
                if sent:
                    self._note(lateness[bus == index][:sent])

    def _note(self, lateness: np.ndarray) -> None:
        self.done.latest = max(self.done.latest, float(lateness.max()))
        self.done.late += np.bincount(np.searchsorted(_LATE_BINS, np.maximum(lateness, 0.0)), minlength=len(_LATE_BINS))
