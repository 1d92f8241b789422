"""From estimates to what a person decides by: health now, alarms over time, remaining life."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ema.core.names import FAULT_MEANING, FAULTS
from ema.core.status import Reason
from ema.monitor import FIRST

from .history import ActuatorHistory
from .prognosis import Prognosis, Trend, prognosis
from .report_settings import ReportSettings, Severity
from .series import Change, Last, Series


@dataclass(frozen=True)
class FaultHealth:
    """One fault of one actuator at the end of the log; k and sd are those of its last usable estimate."""

    fault: str
    meaning: str
    k: float
    sd: float
    severity: Severity | None
    life_threshold: float
    life: Prognosis


@dataclass(frozen=True)
class Health:
    """One actuator at the end of the log. Without a recent usable estimate `last` is None and `faults` is empty."""

    number: int
    method: str
    last: Last | None
    faults: list[FaultHealth]
    changes: list[Change]
    n_changes: int

    @property
    def severity(self) -> Severity | None:
        """The worst of its faults, None when nothing is known."""
        return max((fault.severity for fault in self.faults if fault.severity is not None), default=None)

    @property
    def doubted(self) -> bool:
        """Whether the last usable estimate was made while the model was in doubt."""
        return self.last is not None and Reason.MODEL_IN_DOUBT.name.lower() in self.last.reasons


def health(actuator: ActuatorHistory, settings: ReportSettings, last_ns: int) -> Health:
    """Health by the first method with a recent usable estimate; `last_ns` is the end of the log."""
    for method in settings.methods:
        series = actuator.series.get(method)
        if series is None or series.last is None:
            continue
        if (last_ns - series.last.t_ns) / 1e9 <= settings.recent:
            judged = actuator.series.get(FIRST, series)
            return _health(actuator.number, method, series, judged, series.last, settings)
    return Health(actuator.number, "", None, [], [], 0)


def _health(number: int, method: str, series: Series, judged: Series, last: Last, settings: ReportSettings) -> Health:
    """Numbers by `series`; severity by `judged`, the method of every cycle, as the daemon's alarms."""
    points = series.points
    faults = []
    for index, fault in enumerate(FAULTS):
        threshold = settings.life_threshold(fault)
        with np.errstate(divide="ignore"):
            sd = 1.0 / np.sqrt(points.weight[:, index])
        trend = Trend(points.t_op, points.k[:, index], sd)
        life = prognosis(trend, threshold, np.random.default_rng([number, index]))
        now = float(last.k[index]), float(last.sd[index])
        severity = judged.tracks[fault].severity
        faults.append(FaultHealth(fault, FAULT_MEANING[fault], *now, severity, threshold, life))
    return Health(number, method, last, faults, list(judged.changes), judged.n_changes)
