"""What a listener knows of a bus: estimates, heartbeat, cycles, losses, and what has changed. No I/O, no clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ema.alarms.bus import AlarmListener
from ema.alarms.change import said
from ema.bus import identifiers
from ema.bus.codec import Codec
from ema.bus.protection import GOOD, Receiver
from ema.core.status import LogState, Reason, ServiceState, Status

SILENT_AFTER = 3.0  # a heartbeat comes every second [s]
_EVENTS = 8
ESTIMATES = {"EstimateLinear": "linear", "EstimateLf2": "lf2", "EstimateHf": "hf"}
_LOSSES = ("n_lost", "n_crc_error", "n_wrong_counter", "n_wrong_length", "n_repeated", "n_reordered", "kernel_drops")


@dataclass
class Shown:
    """The last estimate of one actuator by one method; arrays of shape (6,)."""

    t_ns: int
    cycle: int
    status: Status
    reasons: Reason
    k: np.ndarray
    sd: np.ndarray
    latency: float = 0.0  # from the cycle's last sample to the sending [s]


@dataclass
class Beside:
    """A parameter estimated beside the faults of one actuator by one method; `name` is effect.parameter."""

    name: str
    value: float
    sd: float
    low: float
    high: float


@dataclass
class Live:
    """State of the bus as heard.

    Parameters
    ----------
    codec : Codec
    """

    codec: Codec
    estimates: dict[tuple[int, str], Shown] = field(default_factory=dict)
    beside: dict[tuple[int, str, str], Beside] = field(default_factory=dict)  # by actuator, method, parameter
    cycles: dict[int, int] = field(default_factory=dict)  # last cycle number heard of, by actuator
    heartbeat: dict[str, int] = field(default_factory=dict)
    heard_ns: int = 0  # the last heartbeat
    n_frames: int = 0
    on_estimate: Callable[[str, Shown], object] = lambda method, shown: None
    events: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=_EVENTS))

    def __post_init__(self) -> None:
        wanted = [*ESTIMATES, "EstimateNuisance", "Heartbeat", "CycleStart", "CycleEnd"]
        self.alarms = AlarmListener(self.codec)
        self._receiver = Receiver(self.codec, wanted)
        self._silent = False

    @property
    def n_bad(self) -> int:
        """Frames of estimates, heartbeat and cycles that the protection refused here."""
        counts = self._receiver.counts
        return counts.n_crc_error + counts.n_wrong_length + counts.n_wrong_counter

    def update(self, frames: np.ndarray) -> None:
        """Take frames in the order received, shape (n,), FRAME_DTYPE; only those that pass the protection count."""
        self.n_frames += len(frames)
        self.events.extend((change.t_ns, said(change)) for change in self.alarms.update(frames))
        good = frames[self._receiver.check(frames) <= GOOD]
        for message, own in self.codec.split(good):
            values = message.decode(own)
            for row in range(len(own)):
                one = {name: column[row] for name, column in values.items()}
                t_ns, number = int(own["t_ns"][row]), int(identifiers.actuator(own["id"])[row])
                if message.name in ESTIMATES:
                    self._estimate(t_ns, number, ESTIMATES[message.name], one)
                elif message.name == "EstimateNuisance":
                    names = {key: message.fields[key].names.get(int(one[key]), "?") for key in ("method", "parameter")}
                    numbers = (float(one[key]) for key in ("value", "sd", "low", "high"))
                    self.beside[number, *names.values()] = Beside(names["parameter"], *numbers)  # type: ignore[index]
                elif message.name == "Heartbeat":
                    self._beat(t_ns, {name: int(value) for name, value in one.items()})
                elif message.name.startswith("Cycle"):
                    self.cycles[number] = int(one["cycle"])

    @property
    def actuators(self) -> list[int]:
        """Numbers of the actuators heard of."""
        return sorted({number for number, _ in self.estimates} | set(self.cycles))

    def look(self, now_ns: int) -> None:
        """Note a heartbeat that has stopped."""
        silent = bool(self.heard_ns) and now_ns - self.heard_ns > SILENT_AFTER * 1e9
        if silent and not self._silent:
            self.events.append((now_ns, f"no heartbeat for {SILENT_AFTER:g} s"))
        self._silent = silent

    @property
    def silent(self) -> bool:
        """Whether the daemon has stopped, or was never heard."""
        return self._silent or not self.heard_ns

    def _estimate(self, t_ns: int, number: int, method: str, one: dict[str, Any]) -> None:
        status, reasons = Status(int(one["status"])), Reason(int(one["reason"]) & sum(Reason))
        before = self.estimates.get((number, method))
        if (before.status if before else Status.VALID) != status:
            why = f" ({', '.join(reasons.names).replace('_', ' ')})" if reasons and status != Status.VALID else ""
            self.events.append((t_ns, f"actuator {number}: {method} is {_words(status)}{why}"))
        self.estimates[number, method] = shown = Shown(
            *(t_ns, int(one["cycle"]), status, reasons, one["k"], one["sd_k"], float(one["age"]))
        )
        self.on_estimate(method, shown)
        self.cycles[number] = int(one["cycle"])

    def _beat(self, t_ns: int, beat: dict[str, int]) -> None:
        before, self.heartbeat, self.heard_ns = self.heartbeat, beat, t_ns
        if not before or beat["uptime"] < before["uptime"]:
            self.events.append((t_ns, f"daemon heard, {_words(ServiceState(beat['state']))}"))
            return
        if beat["state"] != before["state"]:
            self.events.append((t_ns, f"daemon is {_words(ServiceState(beat['state']))}"))
        if beat["log_state"] != before["log_state"]:
            self.events.append((t_ns, f"log is {_words(LogState(beat['log_state']))}"))
        grown = {name: beat[name] - before[name] for name in _LOSSES if beat.get(name, 0) > before.get(name, 0)}
        if grown:
            text = ", ".join(f"{count} {name.removeprefix('n_').replace('_', ' ')}" for name, count in grown.items())
            self.events.append((t_ns, f"frames at the daemon: {text}"))


def _words(state: Any) -> str:
    return str(state.name).lower().replace("_", " ")
