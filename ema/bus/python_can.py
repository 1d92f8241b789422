"""Any interface of python-can as a port."""

from __future__ import annotations

import time
from typing import Any

import can
import numpy as np

from ema.core import frames as fr
from ema.core.frames import FrameFlag

from .port import MAX_BATCH, Port

_MAX_ERRORS = 100  # in one read, before it gives the processor back
_PAUSE = 0.05  # after a read that met only errors [s]


class PythonCanPort(Port):
    """A python-can bus; takes the bus over and closes it."""

    def __init__(self, bus: can.BusABC, name: str):
        super().__init__(name)
        self._bus = bus
        self._failing = False

    def read(self, timeout: float) -> np.ndarray:
        """See Port."""
        batch = fr.empty(MAX_BATCH)
        count = n_errors = 0
        while count < MAX_BATCH and n_errors < _MAX_ERRORS:
            try:
                message = self._bus.recv(timeout if count == n_errors == 0 else 0)
            except (can.CanError, OSError, ValueError) as error:
                n_errors += 1
                self.counters.n_unreadable += 1
                self._say_once(error)
                continue
            if message is None:
                break
            if message.is_error_frame:
                self.counters.n_error_frames += 1
                continue
            _fill(batch[count], message)
            count += 1
        if count:
            self._failing = False
        elif n_errors == _MAX_ERRORS:
            time.sleep(min(timeout, _PAUSE))
        self.counters.n_received += count
        return batch[:count]

    def write(self, frames: np.ndarray) -> int:
        """See Port."""
        for count, frame in enumerate(frames):
            try:
                self._bus.send(message(frame))
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


def message(frame: Any) -> can.Message:
    """python-can message of one frame (a scalar of FRAME_DTYPE)."""
    flags = int(frame["flags"])
    return can.Message(
        timestamp=int(frame["t_ns"]) / 1e9,
        arbitration_id=int(frame["id"]),
        is_extended_id=bool(flags & FrameFlag.EXTENDED),
        is_remote_frame=bool(flags & FrameFlag.REMOTE),
        is_error_frame=bool(flags & FrameFlag.ERROR),
        is_fd=bool(flags & FrameFlag.FD),
        bitrate_switch=bool(flags & FrameFlag.BRS),
        error_state_indicator=bool(flags & FrameFlag.ESI),
        is_rx=not flags & FrameFlag.TX,
        dlc=int(frame["length"]),
        data=None if flags & FrameFlag.REMOTE else frame["data"][: frame["length"]].tobytes(),
    )


def _fill(frame: Any, message: can.Message) -> None:
    """Write a python-can message into one frame of a zeroed batch."""
    data = message.data
    frame["t_ns"] = round(message.timestamp * 1e9)
    frame["id"] = message.arbitration_id
    frame["flags"] = (
        FrameFlag.EXTENDED * message.is_extended_id
        | FrameFlag.REMOTE * message.is_remote_frame
        | FrameFlag.FD * message.is_fd
        | FrameFlag.BRS * message.bitrate_switch
        | FrameFlag.ESI * message.error_state_indicator
        | FrameFlag.TX * (not message.is_rx)
    )
    frame["length"] = message.dlc
    frame["data"][: len(data)] = data
