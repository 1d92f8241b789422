"""Estimates of one actuator while a log is read, in memory that does not grow with it."""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from ema.alarms import AlarmSettings
from ema.alarms.condition import Condition
from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, Status

from .report_settings import Severity

_N = len(FAULTS)
MOST = 4096  # points kept; when there are more, neighbours are merged
_CHANGES = 50  # of severity, kept


class OperatingTime:
    """Time in which cycles came. A longer silence is a break between flights: wear stands still in it.

    Parameters
    ----------
    longest : float
        A longer silence is a break. [s]
    """

    def __init__(self, longest: float):
        self._longest_ns = round(longest * 1e9)
        self._latest_ns: int | None = None
        self._elapsed_ns = 0
        self.breaks: deque[tuple[float, float]] = deque(maxlen=200)  # time of operation, length [s]
        self.n_breaks = 0

    def at(self, t_ns: int) -> float:
        """Time of operation at `t_ns`, which may lie before the latest one given. [s]"""
        since = 0 if self._latest_ns is None else t_ns - self._latest_ns
        if since > self._longest_ns:
            self.breaks.append((self._elapsed_ns / 1e9, since / 1e9))
            self.n_breaks += 1
            self._latest_ns = t_ns
        elif since < -self._longest_ns or self._latest_ns is None:  # the clock was set back
            self._latest_ns = t_ns
        elif since > 0:
            self._elapsed_ns += since
            self._latest_ns = t_ns
        else:
            return max(0, self._elapsed_ns + since) / 1e9
        return self._elapsed_ns / 1e9


class Change(NamedTuple):
    """A fault's severity changed."""

    t_ns: int
    t_op: float
    fault: str
    severity: Severity
    before: Severity
    k: float


class SeverityTrack:
    """Severity of one fault over time, judged as by the daemon: by the lower end, with persistence and hysteresis.

    Before as many estimates are seen as it takes to find something, nothing is known: None.
    """

    def __init__(self, fault: str, alarms: AlarmSettings):
        self._alarms = alarms
        self._condition = Condition(alarms.faults[fault].setpoints, alarms.persistence, alarms.hysteresis)
        self._n = 0

    @property
    def severity(self) -> Severity | None:
        """Now."""
        if self._condition.level == AlarmLevel.NONE and self._n < self._alarms.persistence.m:
            return None
        return Severity(int(self._condition.level))

    def add(self, k: float, sd: float) -> Severity | None:
        """Take an estimate; the severity before, if it has changed."""
        before = self._condition.level
        self._n += 1
        level = self._condition.update(k - self._alarms.deviations * sd)
        return Severity(int(before)) if level != before else None

    def forget(self) -> None:
        """A break lies before the next estimate."""
        self._condition.forget()


class Points(NamedTuple):
    """Usable estimates, or means of neighbours: t_op shape (n,) [s], the others shape (n, 6).

    `sd` is that of a single estimate, `weight` the sum of 1/sd² of those that a point stands for.
    """

    t_op: np.ndarray
    k: np.ndarray
    sd: np.ndarray
    weight: np.ndarray


class Last(NamedTuple):
    """The last usable estimate."""

    t_ns: int
    cycle: int
    status: Status
    reasons: tuple[str, ...]
    k: np.ndarray
    sd: np.ndarray


class Series:
    """Usable (valid or degraded) estimates of one actuator by one method.

    Parameters
    ----------
    alarms : AlarmSettings

    Attributes
    ----------
    last : Last or None
    tracks : dict of fault to SeverityTrack
    changes : deque of Change
        The latest; `n_changes` counts all.
    """

    def __init__(self, alarms: AlarmSettings):
        self.last: Last | None = None
        self._alarms = alarms
        self.tracks = {fault: SeverityTrack(fault, alarms) for fault in FAULTS}
        self.changes: deque[Change] = deque(maxlen=_CHANGES)
        self.n_changes = 0
        self._table = np.empty((MOST, 1 + 3 * _N))
        self._n = 0

    def add(self, content: dict[str, Any], t_op: float) -> None:
        """Take one estimate as logged; ValueError when it is not one of six faults."""
        k, sd = (np.array([np.nan if x is None else x for x in content[name]], float) for name in ("k", "sd"))
        if len(k) != _N or len(sd) != _N:
            raise ValueError("k or sd is not of length 6")
        status = Status[content["status"].upper()]
        if status > Status.DEGRADED or not np.isfinite(k).all():
            return
        t_ns, before = content["t_ns"], self.last
        self.last = Last(t_ns, content["cycle"], status, tuple(content["reasons"]), k, sd)
        if before is not None and t_ns - before.t_ns > self._alarms.longest_gap * 1e9:
            for track in self.tracks.values():
                track.forget()
        if np.isfinite(sd).all() and not set(content["reasons"]) & set(self._alarms.not_counted):
            self._judge(self.last, t_op)
        if self._n == MOST:
            self._merge()
        known = np.isfinite(sd) & (sd > 0)
        weight = np.where(known, 1.0 / np.where(known, sd, 1.0) ** 2, 0.0)
        self._table[self._n] = [t_op, *k, *sd, *weight]
        self._n += 1

    def _judge(self, last: Last, t_op: float) -> None:
        for fault, k, sd in zip(FAULTS, last.k.tolist(), last.sd.tolist(), strict=True):
            track = self.tracks[fault]
            before = track.add(k, sd)
            if before is not None and track.severity is not None:
                self.changes.append(Change(last.t_ns, t_op, fault, track.severity, before, k))
                self.n_changes += 1

    @property
    def points(self) -> Points:
        """At most MOST points in the order of the log."""
        return _split(self._table[: self._n])

    def _merge(self) -> None:
        one, other = _split(self._table[0::2]), _split(self._table[1::2])
        weight = one.weight + other.weight
        share = np.where(weight > 0, one.weight / np.where(weight > 0, weight, 1.0), 0.5)
        k, sd = share * one.k + (1.0 - share) * other.k, (one.sd + other.sd) / 2
        t_op = (one.t_op + other.t_op) / 2
        self._n = len(t_op)
        self._table[: self._n] = np.column_stack((t_op, k, sd, weight))


def _split(table: np.ndarray) -> Points:
    return Points(table[:, 0], *np.split(table[:, 1:], 3, axis=1))
