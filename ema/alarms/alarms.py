"""All alarms of one monitor: estimates, the monitor's own state and operators' commands in, changes out.

Everything follows from what is given, in its order and with its own times: a log gives the same changes again. Alarms
of an actuator's faults follow from its estimates and from commands; those of supervision from heartbeats, and from the
commands heard a second before: so late that they are surely in the log before the heartbeat.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ema.core import config
from ema.core.status import AlarmLevel, AlarmState

from .causes import CAUSES, OF_MONITOR, Kind
from .change import Change, Measure
from .command import Action, Command, Heard
from .judge import Judge, Judged
from .point import Point
from .settings import AlarmSettings, Latching

HEARD_NS = 1_000_000_000  # a command is certain to be in the log before a heartbeat so much later
VERSION = 1
_NEVER = Latching(watch=False, alarm=False)  # only faults' own alarms latch: the others are about what is going on
_Key = tuple[int | None, str]


class Alarms:
    """Points of every cause for each actuator, and for the monitor itself.

    Parameters
    ----------
    settings : AlarmSettings
    actuators : numbers
    """

    def __init__(self, settings: AlarmSettings, actuators: Iterable[int]):
        self.settings = settings
        self._judges = {number: Judge(settings) for number in actuators}
        of_actuator = [c.name for c in CAUSES.values() if c not in OF_MONITOR]
        keys = [*((n, name) for n in self._judges for name in of_actuator), *((None, c.name) for c in OF_MONITOR)]
        self._points = {key: Point(settings.latching if CAUSES[key[1]].kind is Kind.FAULT else _NEVER) for key in keys}
        self._supervised = [key for key in self._points if _is_supervised(key)]
        self._shelved: set[_Key] = set()
        self._measures: dict[_Key, Measure] = {}
        self._cycles: dict[int, int] = {}
        self._waiting: list[Command] = []  # for points that heartbeats judge

    def estimate(self, judged: Judged) -> list[Change]:
        """Take the estimate of the next cycle of an actuator."""
        number = judged.actuator
        self._cycles[number] = judged.cycle
        changes = self._expire(lambda key: key[0] == number and not _is_supervised(key), judged.t_ns)
        for cause, level, measure in self._judges[number].conditions(judged):
            changes += self._judge((number, cause), level, measure, judged.t_ns)
        return changes

    def supervise(self, t_ns: int, conditions: Mapping[_Key, bool]) -> list[Change]:
        """Take what the monitor says of itself in a heartbeat; what is not named is well."""
        heard = [command for command in self._waiting if command.t_ns <= t_ns - HEARD_NS]
        self._waiting = self._waiting[len(heard) :]
        changes = self._expire(_is_supervised, t_ns)
        for command in heard:
            changes += self._command(command, t_ns)
        for key in self._supervised:
            level = self.settings.supervision.level(key[1]) if conditions.get(key) else AlarmLevel.NONE
            changes += self._judge(key, level, Measure(), t_ns)
        return changes

    def hear(self, heard: Heard) -> list[Change]:
        """Take an operator's command or the temperature of a winding."""
        if isinstance(heard, Command):
            return self.command(heard)
        if heard.actuator in self._judges:
            self._judges[heard.actuator].temp_w = heard.temp_w
        return []

    def command(self, command: Command) -> list[Change]:
        """Do what an operator asks; what cannot be done changes nothing."""
        key = (command.actuator, command.cause)
        if key not in self._points:
            return []
        if _is_supervised(key):
            self._waiting.append(command)
            return []
        return self._command(command, command.t_ns)

    def standing(self, t_ns: int) -> list[Change]:
        """Every alarm that is not inactive, the most urgent first."""
        shown = [self._shown(key, t_ns) for key, point in self._points.items() if point.state != AlarmState.INACTIVE]
        return sorted(shown, key=urgency)

    @property
    def actuators(self) -> list[int]:
        """Whose alarms these are."""
        return list(self._judges)

    def snapshot(self) -> dict[str, Any]:
        """Everything that a restart must not lose, for JSON."""
        points = [
            [number, cause, self._points[number, cause].snapshot(), list(_plain(self._measures.get((number, cause))))]
            for number, cause in self._points
            if not self._points[number, cause].is_fresh
        ]
        return {
            "version": VERSION,
            "settings": config.digest(self.settings),
            "points": points,
            "judges": {str(n): judge.snapshot() for n, judge in self._judges.items()},
            "cycles": {str(n): cycle for n, cycle in self._cycles.items()},
        }

    def restore(self, stored: Mapping[str, Any]) -> None:
        """Go on from a snapshot; of other settings only the alarms themselves are taken, not what led to them.

        Raises
        ------
        ValueError
            It is not a snapshot of this version.
        """
        try:
            if stored["version"] != VERSION:
                raise ValueError(f"version {stored['version']}, this is {VERSION}")
            fresh = type(self)(self.settings, self._judges)
            for number, cause, point, measure in stored["points"]:
                if (number, cause) in fresh._points:
                    fresh._points[number, cause].restore(point)
                    fresh._measures[number, cause] = Measure(*(np.nan if x is None else float(x) for x in measure))
                    if fresh._points[number, cause].shelved_until_ns:
                        fresh._shelved.add((number, cause))
            if stored["settings"] == config.digest(self.settings):
                for number, judge in stored["judges"].items():
                    if int(number) in fresh._judges:
                        fresh._judges[int(number)].restore(judge)
            fresh._cycles = {int(n): int(c) for n, c in stored["cycles"].items() if int(n) in fresh._judges}
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"is no snapshot of alarms ({error!r})") from error
        self.__dict__.update(fresh.__dict__)

    def _judge(self, key: _Key, level: AlarmLevel, measure: Measure, t_ns: int) -> list[Change]:
        self._measures[key] = measure
        # of supervision there is no cycle: heartbeats and cycles are not in step
        cycle = 0 if key[0] is None or _is_supervised(key) else self._cycles.get(key[0], 0)
        return self._changed(key, t_ns, lambda point: point.judge(level, cycle, t_ns))

    def _command(self, command: Command, t_ns: int) -> list[Change]:
        def act(point: Point) -> None:
            if command.action == Action.ACK:
                point.acknowledge()
            elif command.action == Action.CLEAR:
                point.clear()
            elif command.action == Action.UNSHELVE:
                point.unshelve()
            elif command.action == Action.SHELVE:
                longest = self.settings.longest_shelving * 3600.0
                point.shelve(t_ns + round(min(command.duration, longest) * 1e9))

        return self._changed((command.actuator, command.cause), t_ns, act)

    def _expire(self, of: Callable[[_Key], bool], t_ns: int) -> list[Change]:
        changes: list[Change] = []
        for key in sorted((key for key in self._shelved if of(key)), key=str):
            if t_ns >= self._points[key].shelved_until_ns:
                changes += self._changed(key, t_ns, lambda point: point.unshelve())
        return changes

    def _changed(self, key: _Key, t_ns: int, act: Callable[[Point], object]) -> list[Change]:
        point = self._points[key]
        before = point.state, point.level, point.since_ns, point.shelved_until_ns
        act(point)
        if (point.state, point.level, point.since_ns, point.shelved_until_ns) != before:
            (self._shelved.add if point.shelved_until_ns else self._shelved.discard)(key)
            return [self._shown(key, t_ns)]
        return []

    def _shown(self, key: _Key, t_ns: int) -> Change:
        point = self._points[key]
        since = point.since_cycle, point.since_ns
        measure = self._measures.get(key, Measure())
        return Change(t_ns, *key, point.level, point.state, *since, measure, point.shelved_until_ns)


def urgency(change: Change) -> tuple[bool, int, int, int, str]:
    """Sorts alarms: what nobody has acknowledged and is an alarm first, shelved ones last."""
    order = [AlarmState.ACTIVE, AlarmState.ACKNOWLEDGED, AlarmState.LATCHED_CLEARED, AlarmState.SHELVED]
    place = order.index(change.state) if change.state in order else len(order)
    number = -1 if change.actuator is None else change.actuator
    return change.state == AlarmState.SHELVED, -int(change.level), place, number, change.cause


def _is_supervised(key: _Key) -> bool:
    return CAUSES[key[1]].kind is Kind.SUPERVISION


def _plain(measure: Measure | None) -> list[float | None]:
    return [x if np.isfinite(x) else None for x in measure or Measure()]
