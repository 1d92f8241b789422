"""The bus as those see it who send: open while it is this monitor's turn."""

from __future__ import annotations

import numpy as np

from ema.bus.port import Port

from .turn import Turn


class Voice:
    """Writes to the port while it is this monitor's turn; at other times what is written is not sent."""

    def __init__(self, port: Port, turn: Turn):
        self._port, self._turn = port, turn

    def write(self, frames: np.ndarray) -> None:
        """Send frames in order, shape (n,), FRAME_DTYPE."""
        if self._turn.speaking:
            self._port.write(frames)
