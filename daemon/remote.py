"""The daemon's side of a worker process."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Mapping
from contextlib import suppress

from ema.bundle import Bundle
from ema.core.closing import Closing
from ema.identification import Estimate
from ema.monitor import Job

from . import wire
from .answer import unpack_answer
from .wire import WireError, WrongAnswer

_PULSE_EVERY = 0.5  # [s]
_PULSE_TIMEOUT = 1.0  # [s]


class _Line(Closing):
    """A connection to the Unix socket at `path`, made when something is asked."""

    def __init__(self, path: str):
        self._path = path
        self._socket: socket.socket | None = None

    def ask(self, line: bytes, timeout: float) -> bytes:
        """The answer to a line, within `timeout` [s]; OSError where there is none.

        One that was connected to a process that has been restarted since is connected again.
        """
        was_connected = self._socket is not None
        try:
            try:
                return self._exchanged(line, timeout)
            except ConnectionError:
                self.close()
                if not was_connected:
                    raise
                return self._exchanged(line, timeout)
        except OSError:
            self.close()
            raise

    def _exchanged(self, line: bytes, timeout: float) -> bytes:
        if self._socket is None:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
            self._socket.settimeout(timeout)
            self._socket.connect(self._path)
        self._socket.settimeout(timeout)
        self._socket.sendall(line)
        answer = bytearray()
        while not answer.endswith(b"\n"):
            part = self._socket.recv(1 << 16)
            if not part or len(answer) > wire.MAX_LINE:
                raise ConnectionResetError(None, "it has closed the connection")
            answer += part
        return bytes(answer)

    def close(self) -> None:
        """Give the connection up; what is asked next makes another."""
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()
            self._socket = None


class RemoteRunner(Closing):
    """Runs jobs in the process that listens on a Unix socket; connects again when that has been restarted.

    Parameters
    ----------
    path : str
        The socket.
    bundles : mapping of actuator number to Bundle
    timeout : float
        For one answer. [s]
    patience : float
        So long after a job, a process that has not answered is said not to. [s]
    """

    def __init__(self, path: str, bundles: Mapping[int, Bundle], timeout: float = 60.0, patience: float = 60.0):
        self._path, self._bundles, self._timeout, self._patience = path, bundles, timeout, patience
        self._jobs, self._pulse = _Line(path), _Line(path)
        self._beats = True  # when last asked for a sign of life
        self._asked: float | None = None  # since when the answer to a job is waited for, monotonic [s]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._feel, name="ema-pulse", daemon=True)

    def watch(self) -> None:
        """Ask the process for a sign of life from now on, over a connection of its own: also while a job takes long."""
        self._thread.start()

    def answers(self) -> bool:
        """Whether the process gives signs of life and answers its jobs in time, as far as is known."""
        asked = self._asked
        return self._beats and (asked is None or time.monotonic() - asked <= self._patience)

    def run(self, job: Job) -> Estimate:
        """The estimate a job asks for; WireError when there is none."""
        bundle = self._bundles[job.actuator]
        line = wire.pack_job(job, bundle)
        self._asked = time.monotonic()
        try:
            answer = self._jobs.ask(line, self._timeout)
        except OSError as error:
            raise WireError(f"worker at {self._path} does not answer ({error.strerror or error})") from error
        finally:
            self._asked = None
        try:
            return unpack_answer(answer, job, bundle)
        except WrongAnswer:
            self._jobs.close()  # what comes next on this connection may be late as well
            raise

    def close(self) -> None:
        """Give the connections up."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()
        self._jobs.close()
        self._pulse.close()

    def _feel(self) -> None:
        while not self._ended.wait(_PULSE_EVERY):
            try:
                self._pulse.ask(wire.PROBE, _PULSE_TIMEOUT)
            except OSError:
                self._beats = False
            else:
                self._beats = True
