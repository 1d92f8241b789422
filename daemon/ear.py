"""The bus, opened before all else: whether another monitor is there is heard while the rest is still being loaded."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np

from ema.bus.codec import default
from ema.bus.interface import BusSettings, open_bus
from ema.bus.port import passes
from ema.core.closing import Closing
from ema.core.config import Settings, read_yaml, validate

_PAUSE = 0.02  # between two reads; 512 frames come with each, more than any bus carries in that time [s]


class _BusSection(Settings):
    bus: BusSettings = BusSettings()


class Ear(Closing):
    """An open bus, and a thread that keeps what other monitors say on it until the loop takes over.

    Frames of others are let go: nobody can answer them yet, and they must not fill the kernel's buffer.

    Parameters
    ----------
    settings : BusSettings
        BusError when that bus cannot be opened.

    Attributes
    ----------
    port : Port
        To be read by others only after `end`.
    since : float
        When it began to listen, monotonic. [s]
    """

    def __init__(self, settings: BusSettings):
        codec = default()
        self._monitors = codec.filters("Monitor")
        commands = codec.filters_of("AlarmCommand", "TesterSeal", "TesterSession")
        self.port = open_bus(settings, [*codec.filters("Actuator"), *commands, *self._monitors], role="Monitor")
        self.since = time.monotonic()
        self._heard: list[tuple[float, np.ndarray]] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="ema-ear", daemon=True)
        self._thread.start()

    def end(self) -> list[tuple[float, np.ndarray]]:
        """Listen no more; what other monitors have sent, each batch with the monotonic time of its reception [s]."""
        self._ended.set()
        self._thread.join()
        return self._heard

    def close(self) -> None:
        """Give the bus back."""
        self.end()
        self.port.close()

    def _listen(self) -> None:
        while not self._ended.wait(_PAUSE):
            frames = self.port.read(_PAUSE)
            theirs = frames[passes(frames, self._monitors)]
            if theirs.size:
                self._heard.append((time.monotonic(), theirs))


def load_bus(path: Path) -> BusSettings:
    """The section `bus` of a daemon's configuration, whatever the others hold; ConfigError as for the whole."""
    content = read_yaml(path)
    section = {"bus": content["bus"]} if "bus" in content else {}
    return located(validate(section, _BusSection, path).bus, path)


def located(bus: BusSettings, path: Path) -> BusSettings:
    """The same with absolute paths; they are relative to the folder of the configuration at `path`."""
    folder, key_file, session_file = path.resolve().parent, bus.key_file, bus.session_file
    return bus.model_copy(
        update={"key_file": key_file and folder / key_file, "session_file": session_file and folder / session_file}
    )
