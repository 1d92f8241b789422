"""The demo's folder, and how it runs the other programs."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from subprocess import Popen

from ema.core.errors import ConfigError, EmaError

EMA = (sys.executable, "-c", "from ema.cli import main; main()")
LAST_ANSWERS = 1.5  # after the last cycle, until the slower identifier has answered [s]
TOGETHER = (sys.executable, "-m", "ema_demo.together")


@dataclass(frozen=True)
class Files:
    """Where everything is."""

    out: Path

    mark = property(lambda self: self.out / ".ema-demo")
    bundle = property(lambda self: self.out / "bundle")
    scenario = property(lambda self: self.out / "scenario.yaml")
    daemon = property(lambda self: self.out / "daemon.yaml")
    truth = property(lambda self: self.out / "truth.csv")
    log = property(lambda self: self.out / "log")
    said = property(lambda self: self.out / "daemon.txt")
    simulator_said = property(lambda self: self.out / "simulator.txt")
    replayed = property(lambda self: self.out / "replay.json")
    table = property(lambda self: self.out / "estimates.csv")
    plot = property(lambda self: self.out / "estimates.png")
    report = property(lambda self: self.out / "report.html")

    def prepare(self) -> None:
        """Make the folder; remove what an earlier demo made in it, but for the bundle.

        Raises
        ------
        ConfigError
            Something is in it that no demo made.
        """
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            if any(self.out.iterdir()) and not self.mark.exists():
                raise ConfigError(
                    f"{self.out}: was not made by 'ema demo' (no {self.mark.name} in it); choose another --out, "
                    "or remove it if an older version made it"
                )
            self.mark.touch()
            for path in (self.scenario, self.daemon, self.truth, self.table, self.plot, self.report):
                path.unlink(missing_ok=True)
            for path in self.log.glob("ema-*.mcap"):
                path.unlink()
            self.log.mkdir(exist_ok=True)
        except OSError as error:
            raise ConfigError(f"{self.out}: cannot be used as output folder ({error.strerror})") from error

    def made(self) -> Iterator[tuple[Path, str]]:
        """What there is to look at."""
        for meaning in ("bundle", "table", "plot", "report"):
            path = getattr(self, meaning)
            if path.exists():
                yield path, meaning
        for path in sorted(self.log.glob("*.mcap")):
            yield path, "log"


def run(*words: object, output: Path | None = None, program: tuple[str, ...] = EMA, **environment: str) -> Popen[bytes]:
    """Start a program (`ema`) with these words; what it says goes to the terminal or to a file."""
    command = [*program, *map(str, words)]
    if output is None:
        return Popen(command)
    with output.open("w") as file:
        return Popen(command, stdout=file, stderr=file, env={**os.environ, **environment})


def finished(process: Popen[bytes], words: str, said: Path | None = None) -> None:
    """Wait for a program; EmaError when it failed."""
    if process.wait() != 0:
        lines = said.read_text().strip().splitlines() if said else []
        raise EmaError(f"'ema {words}' failed: {lines[-1] if lines else f'exit status {process.returncode}'}")


@contextmanager
def service_manager() -> Iterator[socket.socket]:
    """A socket on which a service tells that it is ready, as systemd has one."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind("")  # a name of its own in the abstract namespace
        yield sock


def address(manager: socket.socket) -> str:
    """What to put into NOTIFY_SOCKET."""
    return "@" + manager.getsockname()[1:].decode()
