"""A port whose frames are sealed on the way out and verified on the way in."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from ema.core.errors import BusError
from ema.core.frames import joined
from ema.core.status import BusState

from .codec import Codec
from .identifiers import MESSAGE_MASK
from .keys import load_keys
from .port import Filters, Port
from .sealer import Sealer
from .sessions import Sessions
from .verifier import Verifier

_LOOK_NS = 1_000_000_000  # between two looks at the key file


class AuthenticatedPort(Port):
    """Another port with message authentication; takes it over and closes it.

    Keys are read again when their file changes.

    Parameters
    ----------
    port : Port
    codec : Codec
    key_file, session_file : Path
        See `keys` and `sessions`; BusError where one cannot be used.
    role : str
        As whom nodes are asked for their session: a sender of the DBC.
    """

    def __init__(self, port: Port, codec: Codec, key_file: Path, session_file: Path, role: str):
        super().__init__(port.name)
        self.choice = f"{port.choice}; frames are authenticated"
        self.counters = port.counters
        self._port = port
        self._key_file, self._file_state = key_file, _state(key_file)
        keyring = load_keys(key_file)
        self._sealer = Sealer(codec, keyring, Sessions(session_file))
        self._verifier = Verifier(codec, keyring, role)
        self._told_without_key: set[object] = set()
        self._looked_ns = time.monotonic_ns()

    @property
    def bus_state(self) -> BusState:
        """See Port."""
        return self._port.bus_state

    @property
    def flooded(self) -> bool:
        """See Port."""
        return self._port.flooded

    @property
    def n_answers(self) -> int:
        """Challenges of others that have been answered: what was sent before, they have refused."""
        return self._sealer.n_answers

    def read(self, timeout: float) -> np.ndarray:
        """See Port; those that are not genuine are marked FrameFlag.REFUSED."""
        frames = self._port.read(timeout)
        decided = self._verifier.feed(frames, time.time_ns())
        now_ns = time.monotonic_ns()
        self._look_at_keys(now_ns)
        said = joined([self._sealer.hear(frames, now_ns), self._verifier.ask(now_ns)])
        if said.size:
            self._port.write(said)
        return decided

    def write(self, frames: np.ndarray) -> int:
        """See Port; the seals go out as well and are not counted in the answer."""
        n_sent = self._port.write(frames)
        made = self._sealer.add(frames[:n_sent])
        if made.size:
            self._port.write(made)
        return n_sent

    def take_events(self) -> list[str]:
        """See Port."""
        new = self._sealer.without_key - self._told_without_key
        self._told_without_key |= new
        lines = [f"key file {self._key_file}: holds no key for what {node} sends" for node in sorted(new)]
        return [*self._port.take_events(), *super().take_events(), *self._verifier.take_events(), *lines]

    def close(self) -> None:
        """See Port."""
        self._port.close()

    def _look_at_keys(self, now_ns: int) -> None:
        if now_ns - self._looked_ns < _LOOK_NS:
            return
        self._looked_ns = now_ns
        state = _state(self._key_file)
        if state == self._file_state:
            return
        self._file_state = state
        try:
            keyring = load_keys(self._key_file)
        except BusError as error:
            self._events.append(f"{error}; the keys of before stay")
            return
        made = self._sealer.rekey(keyring)
        if made.size:
            self._port.write(made)
        self._verifier.keyring = keyring
        self._events.append(f"key file {self._key_file}: keys are changed")


def challenges(codec: Codec) -> Filters:
    """Filters for `open_bus` that let through what asks this node for its session."""
    return [(m.frame_id, MESSAGE_MASK) for m in codec.messages.values() if m.name.endswith("Challenge")]


def _state(path: Path) -> tuple[int, int, int] | None:
    """What of a file is another when its content is."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def session_file_of(key_file: Path) -> Path:
    """Where sessions are kept when nobody says it: beside the key, or where systemd lets a service keep its state."""
    state = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    credentials = os.environ.get("CREDENTIALS_DIRECTORY")
    if state and credentials and Path(credentials) in key_file.parents:
        return Path(state) / "bus.session"
    return key_file.with_name(key_file.name + ".session")
