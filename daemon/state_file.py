"""The file that states of alarms are kept in: replaced as a whole, by a thread of its own that waits for the disk."""

from __future__ import annotations

import json
import logging
import os
import threading
from pathlib import Path
from typing import Any

from ema.core.closing import Closing
from ema.core.files import require_file

logger = logging.getLogger("ema.daemon")


class StateFile(Closing):
    """Reads it once, and writes what it is given; of several waiting only the latest.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path):
        self.path = path
        self._latest: dict[str, Any] | None = None
        self._wake = threading.Condition()
        self._stopping = self._failed = False
        self._thread = threading.Thread(target=self._run, name="ema-alarms", daemon=True)
        self._thread.start()

    def load(self) -> dict[str, Any] | None:
        """What was kept; None where there is nothing. ValueError when it is not JSON of an object."""
        try:
            stored = json.loads(require_file(self.path).read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError) as error:
            raise ValueError(f"cannot be read ({getattr(error, 'strerror', None) or error})") from error
        if not isinstance(stored, dict):
            raise ValueError("is not an object of JSON")
        return stored

    def set_aside(self) -> Path:
        """Keep a file that cannot be used under another name."""
        aside = self.path.with_name(f"{self.path.name}.damaged")
        try:
            self.path.replace(aside)
        except OSError as error:
            logger.warning("%s: cannot be set aside (%s)", self.path, error.strerror)
        return aside

    def save(self, snapshot: dict[str, Any]) -> None:
        """Write it soon; returns at once."""
        with self._wake:
            self._latest = snapshot
            self._wake.notify()

    def close(self) -> None:
        """Write what waits, and end."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._stopping or self._latest is not None)
                snapshot, self._latest = self._latest, None
                stopping = self._stopping
            if snapshot is not None:
                self._write(snapshot)
            if stopping:
                return

    def _write(self, snapshot: dict[str, Any]) -> None:
        part = self.path.with_name(f"{self.path.name}.part")
        try:
            with part.open("wb") as file:
                file.write(json.dumps(snapshot, separators=(",", ":")).encode())
                file.flush()
                os.fsync(file.fileno())
            part.replace(self.path)
            self._failed = False
        except OSError as error:
            if not self._failed:
                logger.warning("%s: states of alarms are not kept (%s)", self.path, error.strerror)
            self._failed = True
