"""SIGHUP: the configuration read again; what may change while running is taken over, all else refused in words."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from ema.core.errors import EmaError
from ema.log import LogSettings, LogWriter

from .alarming import AlarmDesk
from .identity import ATTACHMENT, Identity
from .settings import DaemonSettings, fingerprints, load_alarms, text

# Keys whose change touches no estimate. Thresholds of alarms are logged where they change, and a replay follows.
CHANGEABLE = (*(f"log.{name}" for name in LogSettings.model_fields), "alarms.file")


class Reloader:
    """Applies a changed configuration, and changed thresholds, as far as that is possible at once.

    Parameters
    ----------
    settings : DaemonSettings
        What the daemon runs with.
    read : callable
        The configuration as it is now, with what the command line says instead.
    log : LogWriter
    desk : AlarmDesk
    identity : Identity

    Attributes
    ----------
    identity : Identity
        With the hash of the configuration that holds now.
    """

    def __init__(
        self,
        settings: DaemonSettings,
        read: Callable[[], DaemonSettings],
        log: LogWriter,
        desk: AlarmDesk,
        identity: Identity,
    ):
        self._settings, self._read, self._log, self._desk = settings, read, log, desk
        self.identity = identity

    def reload(self) -> tuple[bool, str]:
        """Whether the configuration was taken over, and what happened in words; the log begins a new segment anyway."""
        try:
            new = self._read()
            alarms = load_alarms(new)
            there = fingerprints(new)
        except EmaError as error:
            return self._refused(str(error))
        changed = dict(_differences(_plain(self._settings), _plain(new)))
        fixed = sorted(key for key in changed if key not in CHANGEABLE)
        if fixed:
            return self._refused(f"{', '.join(fixed)} cannot change while it runs (restart it)")
        others = [new.actuators[n].bundle for n, used in self.identity.bundles.items() if there[n] != used]
        if others:
            return self._refused(f"{others[0]} holds another bundle than the one in use (restart it)")
        thresholds = dict(_differences(_plain(self._desk.alarms.settings), _plain(alarms), "alarms.yaml"))
        self._settings = new
        log = LogSettings(**new.log.model_dump(exclude={"directory"}))
        texts = {"daemon.yaml": text(new), "alarms.yaml": text(alarms)}
        self.identity = self.identity.configured(*texts.values())
        self._log.cut(log, {**texts, ATTACHMENT: self.identity.as_json()})
        if thresholds:
            self._desk.retake(alarms, time.time_ns())
        both = sorted((changed | thresholds).items())
        said = ", ".join(f"{key} {before} → {now}" for key, (before, now) in both)
        return True, f"configuration read again: {said or 'nothing has changed'}"

    def _refused(self, why: str) -> tuple[bool, str]:
        self._log.cut()
        return False, f"configuration not taken over, it goes on as before: {why}"


def _plain(settings: Any) -> Any:
    return settings.model_dump(mode="json")


def _differences(old: Any, new: Any, key: str = "") -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Keys, with dots, that differ, with both values."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() | new.keys():
            yield from _differences(old.get(name), new.get(name), f"{key}.{name}" if key else str(name))
    elif old != new:
        yield key, (old, new)
