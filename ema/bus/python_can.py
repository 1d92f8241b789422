"""Any interface of python-can as a port."""

from __future__ import annotations

import time

import can
import numpy as np

from ema.core import frames as fr
from ema.core.can_messages import fill
from ema.core.can_messages import message as can_message
from ema.core.status import BusState

from .port import MAX_BATCH, Port

# PASSIVE is of most of them a controller that only listens: it marks no errors for others either.
_STATES = {can.BusState.ACTIVE: BusState.ACTIVE, can.BusState.PASSIVE: BusState.ERROR_PASSIVE}
_MAX_ERRORS = 100  # in one read, before it gives the processor back
_PAUSE = 0.05  # after a read that met only errors [s]


class PythonCanPort(Port):
    """A python-can bus; takes the bus over and closes it."""

    def __init__(self, bus: can.BusABC, name: str):
        super().__init__(name)
        self._bus = bus
        self._failing = False
        self._no_state = ""  # why the driver did not tell its state, as said last

    @property
    def bus_state(self) -> BusState:
        """As the interface's driver tells it: few do, of the others it is always active."""
        try:
            return _STATES.get(self._bus.state, BusState.BUS_OFF)
        except (can.CanError, OSError, NotImplementedError) as error:
            if str(error) != self._no_state:
                self._no_state = str(error)
                self._events.append(f"{self.name}: {error}")
            return BusState.DOWN

    def read(self, timeout: float) -> np.ndarray:
        """See Port."""
        batch = fr.empty(MAX_BATCH)
        count = n_errors = n_error_frames = 0
        while count + n_error_frames < MAX_BATCH and n_errors < _MAX_ERRORS:
            try:
                message = self._bus.recv(timeout if count == n_errors == n_error_frames == 0 else 0)
            except (can.CanError, OSError, ValueError) as error:
                n_errors += 1
                self.counters.n_unreadable += 1
                self._say_once(error)
                continue
            if message is None:
                break
            if message.is_error_frame:
                n_error_frames += 1
                continue
            fill(batch[count], message)
            count += 1
        if count:
            self._failing = False
        elif n_errors == _MAX_ERRORS:
            time.sleep(min(timeout, _PAUSE))
        self.counters.n_error_frames += n_error_frames
        self.counters.n_received += count
        return batch[:count]

    def write(self, frames: np.ndarray) -> int:
        """See Port."""
        for count, frame in enumerate(frames):
            try:
                self._bus.send(can_message(frame))
            except (can.CanError, OSError) as error:
                self.counters.n_send_failed += frames.size - count
                self._say_once(error)
                return count
            self.counters.n_sent += 1
        return frames.size

    def close(self) -> None:
        """See Port."""
        self._bus.shutdown()

    def _say_once(self, error: Exception) -> None:
        if not self._failing:
            self._events.append(f"{self.name}: {error}")
        self._failing = True
