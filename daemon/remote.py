"""The daemon's side of a worker process."""

from __future__ import annotations

import socket
import time
from collections.abc import Mapping
from contextlib import suppress

from ema.bundle import Bundle
from ema.identification import Estimate
from ema.monitor import Job

from . import wire
from .answer import unpack_answer
from .wire import WireError, WrongAnswer

_PROBE_TIMEOUT = 1.0  # [s]


class RemoteRunner:
    """Runs jobs in the process that listens on a Unix socket; connects again when that has been restarted.

    Parameters
    ----------
    path : str
        The socket.
    bundles : mapping of actuator number to Bundle
    timeout : float
        For one answer. [s]
    patience : float
        So long after a question, a process that has not answered is said not to. [s]
    """

    def __init__(self, path: str, bundles: Mapping[int, Bundle], timeout: float = 60.0, patience: float = 60.0):
        self._path, self._bundles, self._timeout, self._patience = path, bundles, timeout, patience
        self._socket: socket.socket | None = None
        self._answered = True  # when asked last
        self._asked: float | None = None  # since when an answer is waited for, monotonic [s]

    def answers(self) -> bool:
        """Whether the process answers, as far as is known: asked by another thread than that of the jobs."""
        asked = self._asked
        return self._answered and (asked is None or time.monotonic() - asked <= self._patience)

    def probe(self) -> None:
        """Find out whether the process answers; never raises."""
        with suppress(OSError):
            self._ask(wire.PROBE, _PROBE_TIMEOUT)

    def run(self, job: Job) -> Estimate:
        """The estimate a job asks for; WireError when there is none."""
        bundle = self._bundles[job.actuator]
        line = wire.pack_job(job, bundle)
        try:
            answer = self._ask(line, self._timeout)
        except OSError as error:
            raise WireError(f"worker at {self._path} does not answer ({error.strerror or error})") from error
        try:
            return unpack_answer(answer, job, bundle)
        except WrongAnswer:
            self.close()  # what comes next on this connection may be late as well
            raise

    def _ask(self, line: bytes, timeout: float) -> bytes:
        self._asked = time.monotonic()
        try:
            answer = self._exchanged(line, timeout)
        except OSError:
            self._answered = False
            self.close()
            raise
        finally:
            self._asked = None
        self._answered = True
        return answer

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
        """Give the connection up; the next job makes another."""
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()
            self._socket = None
