"""Alarms and commands as frames, and back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import GOOD, Receiver
from ema.core.status import AlarmLevel, AlarmState

from .alarms import urgency
from .causes import CAUSES, OF_MONITOR
from .change import Change, Measure
from .command import Action, Command, Heard, Warmth

ALARM, COMMAND, SUPPLY = "Alarm", "AlarmCommand", "Supply"
PERIOD = 1.0  # a standing alarm is repeated with each heartbeat [s]
STALE = 3.0  # what was not repeated for so long is not known any more [s]
_NONE = "none"
_NO_END = 1e30  # an interval without an upper end
_OWN = {cause.name for cause in OF_MONITOR}


def alarm_values(change: Change | None, n_standing: int, now_ns: int, codec: Codec) -> dict[str, Any]:
    """Signals of the frame that tells of an alarm; None: there is none."""
    if change is None:
        change = Change(now_ns, None, _NONE, AlarmLevel.NONE, AlarmState.INACTIVE, 0, 0, Measure())
    measure = {
        name: np.clip(np.nan_to_num(x, posinf=_NO_END), -_NO_END, _NO_END)
        for name, x in change.measure._asdict().items()
    }
    left = max(0, change.shelved_until_ns - now_ns)
    return {
        "cause": codec.number(ALARM, "cause", change.cause),
        "level": int(change.level),
        "state": int(change.state),
        "n_standing": n_standing,
        "since_cycle": change.since_cycle,
        "since": np.uint64(change.since_ns),
        **measure,
        "shelved": -(-left // 1_000_000_000),
    }


def command_values(action: Action, cause: str, duration: float, codec: Codec) -> dict[str, Any]:
    """Signals of the frame that asks for something."""
    return {"action": int(action), "cause": codec.number(COMMAND, "cause", cause), "duration": duration}


class Ears:
    """What alarms hear on a bus or in a log besides estimates; only what passes protection and authentication."""

    def __init__(self, codec: Codec, actuators: Iterable[int]):
        numbers = {0, *actuators}
        # one for each message: a tester's restart is not the actuator's
        self._receivers = {name: Receiver(codec, (name,), numbers) for name in (COMMAND, SUPPLY)}
        self._messages = {name: codec.messages[name] for name in self._receivers}

    def hear(self, frames: np.ndarray) -> list[Heard]:
        """Commands and temperatures in a batch, shape (n,), FRAME_DTYPE."""
        ids = identifiers.message_id(frames["id"])
        return [*self._commands(frames, ids), *self._warmth(frames, ids)]

    def _good(self, name: str, frames: np.ndarray, ids: np.ndarray) -> tuple[np.ndarray, list[dict[str, Any]]]:
        own = frames[ids == self._messages[name].frame_id]
        if own.size:
            own = own[self._receivers[name].check(own) <= GOOD]
        return own, _rows(self._messages[name].decode(own)) if own.size else []

    def _commands(self, frames: np.ndarray, ids: np.ndarray) -> Iterator[Command]:
        causes = self._messages[COMMAND].fields["cause"].names
        for frame, values in zip(*self._good(COMMAND, frames, ids), strict=True):
            action, cause = int(values["action"]), causes.get(int(values["cause"]))
            if cause is not None and action in set(Action):
                number = None if cause in _OWN else int(identifiers.actuator(frame["id"]))
                yield Command(int(frame["t_ns"]), Action(action), number, cause, float(values["duration"]))

    def _warmth(self, frames: np.ndarray, ids: np.ndarray) -> Iterator[Warmth]:
        for frame, values in zip(*self._good(SUPPLY, frames, ids), strict=True):
            yield Warmth(int(frame["t_ns"]), int(identifiers.actuator(frame["id"])), float(values["temp_w"]))


class AlarmListener:
    """The alarms that a monitor tells of, as whoever listens to the bus knows them. No I/O, no clock."""

    def __init__(self, codec: Codec):
        self._receiver = Receiver(codec, (ALARM,))
        self._message = codec.messages[ALARM]
        self._alarms: dict[tuple[int | None, str], Change] = {}
        self.heard_ns = 0

    def update(self, frames: np.ndarray) -> list[Change]:
        """Take frames in the order received, shape (n,), FRAME_DTYPE; what has changed."""
        own = frames[identifiers.message_id(frames["id"]) == self._message.frame_id]
        good = own[self._receiver.check(own) <= GOOD] if own.size else own
        changes = []
        for row, values in enumerate(_rows(self._message.decode(good))):
            self.heard_ns = int(good["t_ns"][row])
            change = self._decoded(self.heard_ns, int(identifiers.actuator(good["id"])[row]), values)
            if change is not None and self._take(change):
                changes.append(change)
        return changes

    def known(self, now_ns: int) -> list[Change]:
        """Alarms that are not inactive, the most urgent first; what was not repeated is left out."""
        recent = [c for c in self._alarms.values() if now_ns - c.t_ns <= STALE * 1e9 and c.state != AlarmState.INACTIVE]
        return sorted(recent, key=urgency)

    def find(self, actuator: int | None, cause: str) -> Change | None:
        """What was heard last of one alarm."""
        return self._alarms.get((actuator, cause))

    def _take(self, change: Change) -> bool:
        key = change.actuator, change.cause
        before = self._alarms.get(key)
        self._alarms[key] = change
        seen = (change.state, change.level, change.since_ns)
        return (before.state, before.level, before.since_ns) != seen if before else change.state != AlarmState.INACTIVE

    def _decoded(self, t_ns: int, number: int, values: dict[str, Any]) -> Change | None:
        cause = self._message.fields["cause"].names.get(int(values["cause"]), "")
        if cause not in CAUSES:
            return None
        measure = [float(values[name]) for name in Measure._fields]
        until_ns = t_ns + int(values["shelved"]) * 1_000_000_000 if values["shelved"] else 0
        try:
            level, state = AlarmLevel(int(values["level"])), AlarmState(int(values["state"]))
        except ValueError:
            return None
        since = int(values["since_cycle"]), int(values["since"])
        whose = None if cause in _OWN else number
        return Change(t_ns, whose, cause, level, state, *since, Measure(*measure), until_ns)


def _rows(columns: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
