"""`ema hf-worker`: the identifiers that need a compiler, in a process of their own beside the daemon."""

from __future__ import annotations

import socket
import threading
from collections.abc import Mapping
from pathlib import Path

from ema.bundle import Bundle
from ema.core.errors import BusError
from ema.monitor import Job, Runner

from . import answer, wire
from .wire import WireError

_LOOK_UP = 0.2  # how often a stop is looked for [s]


class Server:
    """Answers jobs on a Unix socket, one after the other; whoever asks beside them whether it is alive, at once.

    Parameters
    ----------
    path : Path
        Of the socket; one that nobody listens on any more is replaced. BusError when it cannot be made.
    bundles : mapping of actuator number to Bundle
    """

    def __init__(self, path: Path, bundles: Mapping[int, Bundle]):
        self._path = path
        self._runner, self._one_job = Runner(bundles), threading.Lock()
        self._fingerprints = {number: wire.fingerprint(bundle) for number, bundle in bundles.items()}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
        try:
            if path.is_socket() and not _listens(path):
                path.unlink()
            self._socket.bind(str(path))
            self._socket.listen()
        except OSError as error:
            self._socket.close()
            raise BusError(f"{path}: the worker's socket cannot be made ({error.strerror})") from error

    def run(self, stop: threading.Event) -> None:
        """Answer until `stop` is set; then remove the socket."""
        self._socket.settimeout(_LOOK_UP)
        serving: list[threading.Thread] = []
        try:
            while not stop.is_set():
                try:
                    connection, _ = self._socket.accept()
                except TimeoutError:
                    continue
                serving = [thread for thread in serving if thread.is_alive()]
                serving.append(threading.Thread(target=self._serve, args=(connection, stop)))
                serving[-1].start()
        finally:
            for thread in serving:
                thread.join()
            self._socket.close()
            self._path.unlink(missing_ok=True)

    def _serve(self, connection: socket.socket, stop: threading.Event) -> None:
        with connection:
            self._talk(connection, stop)

    def _talk(self, connection: socket.socket, stop: threading.Event) -> None:
        connection.settimeout(_LOOK_UP)
        waiting = bytearray()
        while not stop.is_set():
            try:
                part = connection.recv(1 << 16)
            except TimeoutError:
                continue
            except OSError:
                return
            waiting += part
            if not part or len(waiting) > wire.MAX_LINE:
                return
            while b"\n" in waiting and not stop.is_set():
                line, _, waiting = waiting.partition(b"\n")
                try:
                    _send(connection, self._answer(bytes(line)), stop)
                except OSError:
                    return

    def _answer(self, line: bytes) -> bytes:
        try:
            job, fingerprint = wire.unpack_job(line)
            if self._fingerprints.get(job.actuator) != fingerprint:
                raise WireError(f"the worker has another bundle for actuator {job.actuator}")
            with self._one_job:
                estimate = self._runner.run(job)
            return answer.pack_answer(estimate, job, fingerprint)
        except Exception as error:  # the answer, whatever it is
            return answer.pack_error(error)

    def prepare(self, jobs: list[Job]) -> None:
        """Run jobs once, so that whatever is compiled is compiled before the first real one."""
        for job in jobs:
            self._runner.run(job)


def _send(connection: socket.socket, line: bytes, stop: threading.Event) -> None:
    """All of it, however slowly the daemon reads; once `stop` is set, one that does not read is not waited for."""
    left = memoryview(line)
    while left:
        try:
            left = left[connection.send(left) :]
        except TimeoutError:
            if stop.is_set():
                return


def _listens(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except OSError:
            return False
        return True
