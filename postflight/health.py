"""From estimates to what a person decides by: health now, alarms over time, remaining life."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.names import FAULT_MEANING, FAULTS
from ema.core.status import Status

from .history import ActuatorHistory, Series
from .prognosis import Prognosis, Trend, prognosis
from .report_settings import ReportSettings, Severity


@dataclass(frozen=True)
class Alarm:
    """A fault's severity changed."""

    t_ns: int
    fault: str
    severity: Severity
    before: Severity
    k: float


@dataclass(frozen=True)
class FaultHealth:
    """One fault of one actuator at the end of the log; k and sd are those of its last usable estimate."""

    fault: str
    meaning: str
    k: float
    sd: float
    severity: Severity
    life_threshold: float
    life: Prognosis


@dataclass(frozen=True)
class Health:
    """One actuator at the end of the log. Without a recent usable estimate `method` is empty and so is `faults`."""

    number: int
    method: str
    t_ns: int
    cycle: int
    status: Status
    faults: list[FaultHealth]
    alarms: list[Alarm]

    @property
    def severity(self) -> Severity | None:
        """The worst of its faults, None when nothing is known."""
        return max((fault.severity for fault in self.faults), default=None)


def health(actuator: ActuatorHistory, settings: ReportSettings, last_ns: int) -> Health:
    """Health by the first method with a recent usable estimate; `last_ns` is the end of the log."""
    for method in settings.methods:
        series = actuator.series.get(method)
        if series is None or not series.usable.any():
            continue
        last = int(np.flatnonzero(series.usable)[-1])
        if (last_ns - int(series.t_ns[last])) / 1e9 <= settings.recent:
            return _health(actuator.number, method, series, last, settings)
    return Health(actuator.number, "", 0, 0, Status.NOT_ESTIMATED, [], [])


def _health(number: int, method: str, series: Series, last: int, settings: ReportSettings) -> Health:
    usable = series.usable
    t_ns, k, sd = series.t_ns[usable], series.k[usable], series.sd[usable]
    faults, alarms = [], []
    for index, fault in enumerate(FAULTS):
        changes = severities(k[:, index], fault, settings)
        for at, severity in changes[1:]:
            before = next(s for n, s in reversed(changes) if n < at)
            alarms.append(Alarm(int(t_ns[at]), fault, severity, before, float(k[at, index])))
        threshold = settings.life_threshold(fault)
        trend = Trend((t_ns - t_ns[0]) / 1e9, k[:, index], sd[:, index])
        life = prognosis(trend, threshold, np.random.default_rng([number, index]))
        now = float(k[-1, index]), float(sd[-1, index])
        faults.append(FaultHealth(fault, FAULT_MEANING[fault], *now, changes[-1][1], threshold, life))
    alarms.sort(key=lambda alarm: (alarm.t_ns, alarm.fault))
    status = Status(int(series.status[last]))
    return Health(number, method, int(series.t_ns[last]), int(series.cycle[last]), status, faults, alarms)


def severities(k: np.ndarray, fault: str, settings: ReportSettings) -> list[tuple[int, Severity]]:
    """Severity over time: index and value of every change, beginning with index 0.

    It rises to the lowest, and falls to the highest, severity of `persistence` estimates in a row.
    """
    levels = np.searchsorted(settings.severity[fault].levels, k, side="right")
    n = min(settings.persistence, len(levels))
    current = Severity(int(levels[:n].min()))
    changes = [(0, current)]
    windows = np.lib.stride_tricks.sliding_window_view(levels, n)
    low, high = windows.min(axis=1), windows.max(axis=1)
    for at in np.flatnonzero((low[1:] != low[:-1]) | (high[1:] != high[:-1])) + 1:
        if low[at] > current or high[at] < current:
            current = Severity(int(low[at] if low[at] > current else high[at]))
            changes.append((int(at) + n - 1, current))
    return changes
