"""What a report needs of a log, read in one pass: compact arrays of estimates, and few whole messages."""

from __future__ import annotations

from array import array
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ema.core.errors import LogError
from ema.core.names import FAULTS
from ema.core.status import Status
from ema.log import LogReader

_N = len(FAULTS)
_LAST = 200  # events and flagged cycles kept
_STATUS = {status.name.lower(): int(status) for status in Status}


@dataclass(frozen=True)
class Series:
    """Estimates of one actuator by one method, arrays of length n (k, sd: shape (n, 6)); NaN where there is none."""

    t_ns: np.ndarray
    cycle: np.ndarray
    status: np.ndarray
    p_value: np.ndarray
    k: np.ndarray
    sd: np.ndarray

    @property
    def usable(self) -> np.ndarray:
        """Which are valid or degraded, with numbers."""
        seen: np.ndarray = (self.status <= Status.DEGRADED) & np.isfinite(self.k).all(axis=1)
        return seen


class _Growing:
    """A series while it is read."""

    def __init__(self) -> None:
        self.t_ns, self.cycle, self.status = array("q"), array("q"), array("b")
        self.numbers = array("d")

    def add(self, content: dict[str, Any]) -> None:
        self.t_ns.append(content["t_ns"])
        self.cycle.append(content["cycle"])
        self.status.append(_STATUS[content["status"]])
        values = [content["p_value"], *content["k"], *content["sd"]]
        if len(values) != 1 + 2 * _N:
            raise ValueError("k or sd is not of length 6")
        self.numbers.extend(np.nan if value is None else value for value in values)

    def finished(self) -> Series:
        numbers = np.array(self.numbers).reshape(-1, 1 + 2 * _N)
        t_ns, cycle, status = (np.array(column) for column in (self.t_ns, self.cycle, self.status))
        return Series(t_ns, cycle, status, numbers[:, 0], numbers[:, 1 : 1 + _N], numbers[:, 1 + _N :])


@dataclass
class ActuatorHistory:
    """All of one actuator.

    `reasons` counts the cycles of the first method (linear) by reason, `flagged` holds the last of those estimates that
    are not valid, `last` and `worst` the latest envelope and the one whose estimate has the lowest p-value.
    """

    number: int
    series: dict[str, Series] = field(default_factory=dict)
    statuses: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    flagged: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_LAST))
    n_flagged: int = 0
    last: dict[str, Any] | None = None
    worst: dict[str, Any] | None = None
    worst_p: float = np.inf

    @property
    def missing_cycles(self) -> int:
        """Cycle numbers left out between the first and the last of the log, restarts not counted."""
        linear = self.series.get("linear")
        if linear is None or len(linear.cycle) < 2:
            return 0
        steps = np.diff(linear.cycle)
        return int((steps[steps > 1] - 1).sum())


@dataclass
class History:
    """All of a log."""

    actuators: dict[int, ActuatorHistory] = field(default_factory=dict)
    events: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_LAST))
    event_counts: Counter[str] = field(default_factory=Counter)
    starts: int = 0  # of the daemon, by its uptime
    status: dict[str, Any] | None = None  # the last one
    counters: Counter[str] = field(default_factory=Counter)  # over all starts
    states: Counter[str] = field(default_factory=Counter)
    log_states: Counter[str] = field(default_factory=Counter)
    silences: list[tuple[int, float]] = field(default_factory=list)  # of the heartbeat: time [ns], length [s]
    clock_steps: list[tuple[int, float]] = field(default_factory=list)  # time [ns] and size [s]
    first_ns: int = 0
    last_ns: int = 0


_SILENCE = 3.0  # heartbeats come every second [s]
_CLOCK_STEP = 0.1  # wall clock against uptime [s]


def read(log: LogReader) -> History:
    """Read everything but the raw frames. LogError when the log holds no estimate."""
    history = History()
    growing: dict[tuple[int, str], _Growing] = {}
    for topic, t_ns, content in log.messages():
        history.first_ns = min(history.first_ns or t_ns, t_ns)
        history.last_ns = max(history.last_ns, t_ns)
        try:
            if topic.startswith("/estimate/"):
                growing.setdefault((content["actuator"], content["method"]), _Growing()).add(content)
                _note_estimate(_actuator(history, content), content)
            elif topic.startswith("/envelope/"):
                _note_envelope(_actuator(history, content), content)
            elif topic == "/event":
                history.events.append(content)
                history.event_counts[content["level"]] += 1
            elif topic == "/status":
                _note_status(history, content)
        except (KeyError, TypeError, ValueError) as error:
            raise LogError(f"a message on {topic} is not what this version writes ({error!r})") from error
    if not growing:
        raise LogError(f"{', '.join(path.name for path in log.paths)}: no estimate in it")
    for (actuator, method), series in growing.items():
        history.actuators[actuator].series[method] = series.finished()
    history.actuators = dict(sorted(history.actuators.items()))
    return history


def _actuator(history: History, content: dict[str, Any]) -> ActuatorHistory:
    return history.actuators.setdefault(content["actuator"], ActuatorHistory(content["actuator"]))


def _note_estimate(actuator: ActuatorHistory, content: dict[str, Any]) -> None:
    if content["status"] != "valid":
        actuator.flagged.append(content)
        actuator.n_flagged += 1
    if content["method"] == "linear":
        actuator.statuses[content["status"]] += 1
        actuator.reasons.update(content["reasons"])
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


def _note_status(history: History, content: dict[str, Any]) -> None:
    before = history.status
    history.states[content["state"]] += 1
    history.log_states[content["log_state"]] += 1
    counters: dict[str, int] = content["counters"]
    if before is None or content["uptime"] < before["uptime"]:
        history.starts += 1
        history.counters.update(counters)
    else:
        history.counters.update({name: n - before["counters"].get(name, 0) for name, n in counters.items()})
        wall, up = (content["t_ns"] - before["t_ns"]) / 1e9, content["uptime"] - before["uptime"]
        if up > _SILENCE:
            history.silences.append((before["t_ns"], up))
        if abs(wall - up) > _CLOCK_STEP:
            history.clock_steps.append((content["t_ns"], wall - up))
    history.status = content
