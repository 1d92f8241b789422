"""What a report needs of a log, read in one pass and in memory that does not grow with it."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ema.core.errors import LogError
from ema.log import LogReader

from .open_log import names
from .report_settings import ReportSettings
from .series import OperatingTime, Series

_LAST = 200  # events and flagged cycles kept
_POINTS = 600  # drawn of a parameter beside the faults
_PLACES = 20  # silences and steps of the clock kept
_SILENCE = 3.0  # heartbeats come every second [s]
_CLOCK_STEP = 0.1  # wall clock against uptime [s]


@dataclass
class Beside:
    """A parameter estimated beside the faults: some of its cycles, evenly, and its latest message."""

    t_ns: list[int] = field(default_factory=list)
    value: list[float] = field(default_factory=list)
    sd: list[float] = field(default_factory=list)
    last: dict[str, Any] = field(default_factory=dict)
    n: int = 0
    every: int = 1

    def add(self, content: dict[str, Any]) -> None:
        """Take one message (`ema.log.schemas.NUISANCE`)."""
        self.last = content
        if self.n % self.every == 0:
            for name in ("t_ns", "value", "sd"):
                getattr(self, name).append(content[name])
        self.n += 1
        if len(self.t_ns) > _POINTS:
            self.t_ns, self.value, self.sd = self.t_ns[::2], self.value[::2], self.sd[::2]
            self.every *= 2


@dataclass
class ActuatorHistory:
    """All of one actuator.

    `statuses` and `reasons` count the cycles of the first method (linear), `flagged` holds the last of all estimates
    that are not valid, `beside` parameters estimated beside the faults by method and name, `last` and `worst` the
    latest envelope and the one whose estimate has the lowest p-value.
    """

    number: int
    operating: OperatingTime
    series: dict[str, Series] = field(default_factory=dict)
    statuses: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    flagged: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_LAST))
    beside: dict[tuple[str, str], Beside] = field(default_factory=dict)
    n_flagged: int = 0
    missing_cycles: int = 0  # numbers left out, restarts not counted
    cycle: int | None = None  # the last one
    last: dict[str, Any] | None = None
    worst: dict[str, Any] | None = None
    worst_p: float = np.inf


@dataclass
class History:
    """All of a log."""

    actuators: dict[int, ActuatorHistory] = field(default_factory=dict)
    events: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_LAST))
    event_counts: Counter[str] = field(default_factory=Counter)
    alarms: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_LAST))  # changes
    n_alarms: int = 0  # changes
    standing: dict[tuple[int | None, str], dict[str, Any]] = field(default_factory=dict)  # at the end, as last told
    starts: int = 0  # of the daemon, by its uptime
    status: dict[str, Any] | None = None  # the last one
    counters: Counter[str] = field(default_factory=Counter)  # over all starts
    latency_us: int | None = None  # of the slowest answer, from a cycle's last frame to the bus
    states: Counter[str] = field(default_factory=Counter)
    log_states: Counter[str] = field(default_factory=Counter)
    silences: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=_PLACES))  # time [ns], length [s]
    n_silences: int = 0
    clock_steps: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=_PLACES))  # time [ns], size [s]
    n_clock_steps: int = 0
    first_ns: int = 0
    last_ns: int = 0


def read(log: LogReader, settings: ReportSettings) -> History:
    """Read everything but the raw frames. LogError when the log holds no estimate."""
    history = History()
    for topic, t_ns, content in log.messages():
        history.first_ns = min(history.first_ns or t_ns, t_ns)
        history.last_ns = max(history.last_ns, t_ns)
        try:
            if topic.startswith("/estimate/"):
                _note_estimate(_actuator(history, content, settings), content, settings)
            elif topic.startswith("/nuisance/"):
                beside = _actuator(history, content, settings).beside
                beside.setdefault((content["method"], content["parameter"]), Beside()).add(content)
            elif topic.startswith("/envelope/"):
                _note_envelope(_actuator(history, content, settings), content)
            elif topic == "/event":
                history.events.append(content)
                history.event_counts[content["level"]] += 1
            elif topic == "/alarm":
                _note_alarm(history, content)
            elif topic == "/status":
                _note_status(history, content)
        except (KeyError, TypeError, ValueError) as error:
            raise LogError(f"a message on {topic} is not what this version writes ({error!r})") from error
    if not any(actuator.series for actuator in history.actuators.values()):
        raise LogError(f"{names(log.paths)}: no estimate in it")
    history.actuators = dict(sorted(history.actuators.items()))
    return history


def _actuator(history: History, content: dict[str, Any], settings: ReportSettings) -> ActuatorHistory:
    number = content["actuator"]
    if number not in history.actuators:
        history.actuators[number] = ActuatorHistory(number, OperatingTime(settings.longest_gap))
    return history.actuators[number]


def _note_estimate(actuator: ActuatorHistory, content: dict[str, Any], settings: ReportSettings) -> None:
    method = content["method"]
    if method not in actuator.series:
        actuator.series[method] = Series(settings.alarms)
    actuator.series[method].add(content, actuator.operating.at(content["t_ns"]))
    if content["status"] != "valid":
        actuator.flagged.append(content)
        actuator.n_flagged += 1
    if method == "linear":
        actuator.statuses[content["status"]] += 1
        actuator.reasons.update(content["reasons"])
        if actuator.cycle is not None:
            actuator.missing_cycles += max(0, content["cycle"] - actuator.cycle - 1)
        actuator.cycle = content["cycle"]
        p_value = content["p_value"]
        if p_value is not None and p_value < actuator.worst_p:
            actuator.worst_p, actuator.worst = p_value, content | {"awaited": True}


def _note_envelope(actuator: ActuatorHistory, content: dict[str, Any]) -> None:
    """An envelope follows the estimate of its cycle."""
    if any(value is not None for value in content["measured"]):
        actuator.last = content
    worst = actuator.worst
    if worst is not None and worst.get("awaited") and worst["cycle"] == content["cycle"]:
        actuator.worst = content


def _note_alarm(history: History, content: dict[str, Any]) -> None:
    history.alarms.append(content)
    history.n_alarms += 1
    key = content["actuator"], content["cause"]
    history.standing.pop(key, None)
    if content["state"] != "inactive":
        history.standing[key] = content


def _note_status(history: History, content: dict[str, Any]) -> None:
    before = history.status
    history.states[content["state"]] += 1
    history.log_states[content["log_state"]] += 1
    counters: dict[str, int] = dict(content["counters"])
    latency_us = counters.pop("latency_us", None)
    if latency_us is not None:
        history.latency_us = max(history.latency_us or 0, latency_us)
    if before is None or content["uptime"] < before["uptime"]:
        history.starts += 1
        history.counters.update(counters)
    else:
        history.counters.update({name: n - before["counters"].get(name, 0) for name, n in counters.items()})
        wall, up = (content["t_ns"] - before["t_ns"]) / 1e9, content["uptime"] - before["uptime"]
        if up > _SILENCE:
            history.silences.append((before["t_ns"], up))
            history.n_silences += 1
        if abs(wall - up) > _CLOCK_STEP:
            history.clock_steps.append((content["t_ns"], wall - up))
            history.n_clock_steps += 1
    history.status = content
