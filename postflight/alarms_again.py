"""Alarms made again from a log, beside those in it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from ema.alarms import Alarms, AlarmSettings, Change, Heard, Judged
from ema.alarms.change import said
from ema.alarms.supervision import conditions
from ema.core.errors import LogError
from ema.log import Message, contents, schemas
from ema.log.schemas import Encoded
from ema.monitor import FIRST, Output
from ema.monitor.outputs import Identified


class AlarmsAgain:
    """Follows a log as the daemon followed its bus; silent until the log says what its alarms went on from.

    Parameters
    ----------
    settings : AlarmSettings or None
        Those of the log; None: it was made without alarms.
    actuators : numbers
    """

    def __init__(self, settings: AlarmSettings | None, actuators: Iterable[int]):
        self._settings, self._actuators = settings, list(actuators)
        self._alarms: Alarms | None = None

    @property
    def follows(self) -> bool:
        """Whether what the alarms went on from is known: before, there is nothing to compare with."""
        return self._alarms is not None

    def logged(self, message: Message) -> Iterator[Encoded]:
        """Take what the daemon logged of itself: what its alarms went on from, and heartbeats."""
        if message.topic == schemas.ALARM_STATE.topic and self._settings is not None:
            try:
                said = message.content.get("settings")  # not in logs of earlier versions
                settings = AlarmSettings.model_validate(said) if said else self._settings
                self._alarms = Alarms(settings, self._actuators)
                self._alarms.restore(message.content["snapshot"])
            except (ValueError, KeyError) as error:
                raise LogError(f"a message on {message.topic} is not what this version writes ({error})") from error
        elif message.topic == schemas.STATUS.topic and self._alarms is not None:
            yield from _told(self._alarms.supervise(message.content["t_ns"], conditions(message.content)))

    def hear(self, heard: Heard) -> Iterator[Encoded]:
        """Take an operator's command, or the temperature of a winding."""
        if self._alarms is not None:
            yield from _told(self._alarms.hear(heard))

    def answer(self, out: Output) -> Iterator[Encoded]:
        """Take an answer of the monitor."""
        if self._alarms is not None and isinstance(out, Identified) and out.estimate.method == FIRST:
            yield from _told(self._alarms.estimate(Judged.of(out)))


class AlarmComparison:
    """Counts changes in the log and made again; they are equal to the last bit or not."""

    def __init__(self) -> None:
        self._logged: Counter[str] = Counter()
        self._again: Counter[str] = Counter()

    def logged(self, content: dict[str, Any]) -> None:
        """A change in the log."""
        self._logged[json.dumps(content, sort_keys=True)] += 1

    def again(self, content: dict[str, Any]) -> None:
        """A change made now."""
        self._again[json.dumps(content, sort_keys=True)] += 1

    @property
    def counts(self) -> dict[str, int]:
        """Changes that are equal, only in the log, and only made now."""
        equal = (self._logged & self._again).total()
        only = {"n_only_logged": self._logged.total() - equal, "n_only_again": self._again.total() - equal}
        return {"n_equal": equal, **only}

    @property
    def n_different(self) -> int:
        """Changes without an equal counterpart."""
        return self.counts["n_only_logged"] + self.counts["n_only_again"]


def _told(changes: Iterable[Change]) -> Iterator[Encoded]:
    return (schemas.ALARM.encode(contents.alarm(change, said(change))) for change in changes)
