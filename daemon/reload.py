"""SIGHUP: the configuration read again; what may change while running is taken over, all else refused in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ema.core.errors import EmaError
from ema.log import LogSettings, LogWriter

from .settings import DaemonSettings, text

# Keys whose change touches no answer: replay uses what the log's first segment says.
CHANGEABLE = tuple(f"log.{name}" for name in LogSettings.model_fields)


class Reloader:
    """Applies a changed configuration as far as that is possible at once.

    Parameters
    ----------
    settings : DaemonSettings
        What the daemon runs with.
    read : callable
        The configuration as it is now, with what the command line says instead.
    log : LogWriter
    """

    def __init__(self, settings: DaemonSettings, read: Callable[[], DaemonSettings], log: LogWriter):
        self._settings, self._read, self._log = settings, read, log

    def reload(self) -> tuple[bool, str]:
        """Whether the configuration was taken over, and what happened in words; the log begins a new segment anyway."""
        try:
            new = self._read()
        except EmaError as error:
            self._log.cut()
            return False, f"configuration not taken over, it goes on as before: {error}"
        changed = dict(_differences(self._settings.model_dump(mode="json"), new.model_dump(mode="json")))
        fixed = sorted(key for key in changed if key not in CHANGEABLE)
        if fixed:
            self._log.cut()
            return False, (
                f"configuration not taken over, it goes on as before: {', '.join(fixed)} cannot change while it runs "
                "(restart it)"
            )
        self._settings = new
        log = LogSettings(**new.log.model_dump(exclude={"directory"}))
        self._log.cut(log, {"daemon.yaml": text(new)})
        said = ", ".join(f"{key} {before} → {now}" for key, (before, now) in sorted(changed.items()))
        return True, f"configuration read again: {said or 'nothing has changed'}"


def _differences(old: Any, new: Any, key: str = "") -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Keys, with dots, that differ, with both values."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() | new.keys():
            yield from _differences(old.get(name), new.get(name), f"{key}.{name}" if key else str(name))
    elif old != new:
        yield key, (old, new)
