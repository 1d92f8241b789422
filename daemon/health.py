"""The daemon's own state: what it has counted, what does not happen, and the heartbeat made of both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field

from ema.bus.port import Port
from ema.core.status import IMPLAUSIBLE, BusState, Lapse, LogState, Reason, ServiceState, Status
from ema.log import LogWriter
from ema.monitor import FIRST, Event, Identified, Job, Level, Monitor
from ema.monitor.supervision import Promise, Supervisor

from .supervision import estimate_of, event, worker_of

# Counts whose growth means that data are missing or bad, and how an event says it.
_TROUBLE = {
    "n_lost": "lost",
    "n_crc_error": "with a wrong CRC",
    "n_wrong_counter": "far off their sequence",
    "n_wrong_length": "of wrong length",
    "n_repeated": "repeated",
    "n_reordered": "late",
    "n_refused": "refused, not authentic",
    "kernel_drops": "dropped by the kernel (receive buffer full)",
}
_HARMLESS = {"n_repeated", "n_reordered"}  # noted, but no data are missing
_SHOWS = {  # which promises of an actuator a good frame of its shows to be kept
    "CycleStart": Lapse.NO_CYCLES,
    "CycleEnd": Lapse.NO_CYCLES,
    "PhaseCurrents": Lapse.NO_CURRENTS,
    "Motion": Lapse.NO_MOTION,
    "Supply": Lapse.NO_SUPPLY,
}
_NOBODY = 255  # Heartbeat.concerned
_MIB = 1 << 20


@dataclass
class Health:
    """What the loop tells it, and what it sees itself: `look` often, `beat` once in a heartbeat.

    Attributes
    ----------
    answering : mapping of method to callable
        Whether the process that runs a remote identifier answers.
    """

    monitor: Monitor
    port: Port
    log: LogWriter
    supervisor: Supervisor
    answering: Mapping[str, Callable[[], bool]] = field(default_factory=dict)
    n_skipped: int = 0  # jobs no worker had time for
    n_failed: int = 0  # jobs that ended in an error
    n_timeout: int = 0  # times that something expected of an actuator did not come
    latency: float = 0.0  # longest from a cycle's last frame to its linear estimate on the bus, since the last beat [s]
    contested: frozenset[int] = frozenset()  # actuators that another monitor watches as well
    standing_by: bool = False
    state: ServiceState = ServiceState.STARTING
    counters: dict[str, int] = field(default_factory=dict)
    _heard: dict[tuple[int, str], int] = field(default_factory=dict)

    def look(self, now: float, wall_ns: int) -> list[Event]:
        """See what is kept of the promises at `now`, a monotonic time [s]; what has changed since the last look."""
        table = self.supervisor
        table.advance(now)
        self._listen()
        bus = self.port.bus_state
        table.show(
            {
                Promise(Lapse.BUS_DOWN): bus is not BusState.DOWN,
                Promise(Lapse.BUS_OFF): bus is not BusState.BUS_OFF,
                Promise(Lapse.ERROR_PASSIVE): bus is not BusState.ERROR_PASSIVE,
                Promise(Lapse.FLOODED): not self.port.flooded,
                Promise(Lapse.LOG): self.log.state is LogState.OK and not self.log.hangs,
                **{Promise(Lapse.SECOND_MONITOR, n): n not in self.contested for n in self.monitor.actuators},
                **{worker_of(method): answers() for method, answers in self.answering.items()},
            }
        )
        events = [Event(wall_ns, Level.WARNING, "link", line) for line in self.port.take_events()]
        for change in table.look():
            self.n_timeout += change.lapsed and change.promise.actuator is not None
            detail = ""
            if change.promise.lapse is Lapse.LOG:
                detail = ": its device hangs" if self.log.hangs else f": it is {self.log.state.name.lower()}"
            if told := event(change, wall_ns, detail):
                events.append(told)
        self.state = self._judge()
        return events

    def beat(self, wall_ns: int) -> list[Event]:
        """Update the counters; what they tell of the time since the last beat."""
        before, self.counters = self.counters, self._count()
        grown = {name: self.counters[name] - before.get(name, 0) for name in _TROUBLE}
        missing = any(n > 0 for name, n in grown.items() if name not in _HARMLESS)
        self.supervisor.show({Promise(Lapse.FRAMES): not missing})
        self.supervisor.look()
        self.state = self._judge()
        self.latency = 0.0
        if not any(grown.values()):
            return []
        text = ", ".join(f"{n} {_TROUBLE[name]}" for name, n in grown.items() if n > 0)
        return [Event(wall_ns, Level.WARNING, "frames", f"frames since the last heartbeat: {text}")]

    def estimated(self, out: Identified, age: float) -> None:
        """An estimate has been sent."""
        e = out.estimate
        usable = e.status <= Status.DEGRADED and not e.reasons & Reason.LATE
        table, promise = self.supervisor, estimate_of(out.actuator, e.method)
        if usable:
            table.keep(promise)
        elif e.reasons & Reason.LATE:
            table.fail(promise)
        if e.method == FIRST:
            self.latency = max(self.latency, age)
            table.show({Promise(Lapse.CHANNEL, out.actuator): not e.reasons & IMPLAUSIBLE})

    def skipped(self, job: Job) -> None:
        """A job was not done: its identifier is behind."""
        self.n_skipped += 1
        self.supervisor.fail(estimate_of(job.actuator, job.method))

    def failed(self, job: Job) -> None:
        """A job has ended in an error."""
        self.n_failed += 1
        self.supervisor.fail(estimate_of(job.actuator, job.method))

    def heartbeat(self, uptime: float) -> dict[str, int | float]:
        """Signals of the heartbeat frame."""
        sent = "n_cycles n_estimates n_lost n_repeated n_reordered n_crc_error n_wrong_counter n_wrong_length n_timeout"
        counts = {name: self.counters[name] for name in [*sent.split(), "n_foreign", "n_refused", "kernel_drops"]}
        gravest = self.supervisor.gravest
        return {
            **counts,
            "state": int(self.state),
            "log_state": int(self.log.state),
            "log_free": self.log.free_bytes // _MIB,
            "uptime": int(uptime),
            "reason": int(gravest.lapse if gravest else Lapse.NONE),
            "concerned": _NOBODY if gravest is None or gravest.actuator is None else gravest.actuator,
        }

    def supervision(self) -> dict[str, int]:
        """Signals of the frame that says everything that does not happen."""
        lapsed = self.supervisor.lapsed
        return {
            "reasons": _bits({promise.lapse for promise in lapsed}),
            "concerned": _bits({promise.actuator for promise in lapsed if promise.actuator is not None}),
            "watched": _bits(self.monitor.actuators),
        }

    def _listen(self) -> None:
        """Whom has been heard since the last look."""
        heard = self.monitor.heard
        for (actuator, message), count in heard.items():
            if count > self._heard.get((actuator, message), 0):
                self.supervisor.keep(Promise(Lapse.SILENT, actuator))
                self.supervisor.keep(Promise(_SHOWS[message], actuator))
        self._heard = heard

    def _judge(self) -> ServiceState:
        if self.standing_by:
            return ServiceState.STANDBY
        if self.supervisor.lapsed:
            return ServiceState.DEGRADED
        return ServiceState.STARTING if self.supervisor.awaited else ServiceState.RUNNING

    def _count(self) -> dict[str, int]:
        port = self.port.counters
        return {
            "n_cycles": self.monitor.n_cycles,
            "n_estimates": self.monitor.n_estimates,
            **asdict(self.monitor.counts),
            "n_timeout": self.n_timeout,
            "kernel_drops": port.kernel_drops,
            "n_received": port.n_received,
            "n_sent": port.n_sent,
            "n_send_failed": port.n_send_failed,
            "n_error_frames": port.n_error_frames,
            "n_unreadable": port.n_unreadable,
            "n_link_down": port.n_link_down,
            "n_not_logged": self.log.dropped,
            "n_skipped": self.n_skipped,
            "n_failed": self.n_failed,
            "latency_us": round(1e6 * self.latency),
        }


def _bits(numbers: set[int] | set[Lapse] | frozenset[int]) -> int:
    return sum(1 << int(number) for number in numbers)
