"""The daemon's own state: counts, events made of what has been counted, and the heartbeat."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from ema.bus.port import Port
from ema.core.status import LogState, ServiceState
from ema.log import LogWriter
from ema.monitor import Event, Level, Monitor

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
_MIB = 1 << 20


@dataclass
class Health:
    """Looked at once in a heartbeat."""

    monitor: Monitor
    port: Port
    log: LogWriter
    n_skipped: int = 0  # jobs no worker had time for
    n_failed: int = 0  # jobs that ended in an error
    latency_ns: int = 0  # longest from a cycle's last frame to its linear estimate on the bus, since the last look
    state: ServiceState = ServiceState.STARTING
    counters: dict[str, int] = field(default_factory=dict)
    _log_state: LogState = LogState.OK
    _silent: set[tuple[str, int]] = field(default_factory=set)

    def look(self, now_ns: int) -> list[Event]:
        """Update counters and state; what has happened since the last look."""
        silent = set(self.monitor.time_outs(now_ns))
        before, self.counters = self.counters, self._count()
        grown = {name: self.counters[name] - before.get(name, 0) for name in _TROUBLE}
        events = [
            Event(now_ns, Level.WARNING, "time_out", f"{message} frames do not come", actuator)
            for message, actuator in sorted(silent - self._silent)
        ]
        events += [
            Event(now_ns, Level.INFO, "in_time", f"{message} frames come again", actuator)
            for message, actuator in sorted(self._silent - silent)
        ]
        self._silent = silent
        events += [Event(now_ns, Level.WARNING, "link", line) for line in self.port.take_events()]
        if any(grown.values()):
            text = ", ".join(f"{n} {_TROUBLE[name]}" for name, n in grown.items() if n > 0)
            events.append(Event(now_ns, Level.WARNING, "frames", f"frames since the last heartbeat: {text}"))
        if self.log.state is not self._log_state:
            self._log_state = self.log.state
            good = self._log_state is LogState.OK
            level = Level.INFO if good else Level.ERROR
            events.append(Event(now_ns, level, "log", f"log: {self._log_state.name.lower()}"))
        missing = any(n > 0 for name, n in grown.items() if name not in _HARMLESS)
        sound = self._log_state is LogState.OK and not silent and not missing
        self.state = ServiceState.RUNNING if sound else ServiceState.DEGRADED
        self.latency_ns = 0
        return events

    def heartbeat(self, uptime: float) -> dict[str, int | float]:
        """Signals of the heartbeat frame."""
        sent = "n_cycles n_estimates n_lost n_repeated n_reordered n_crc_error n_wrong_counter n_wrong_length n_timeout"
        counts = {name: self.counters[name] for name in [*sent.split(), "n_foreign", "n_refused", "kernel_drops"]}
        return {
            **counts,
            "state": int(self.state),
            "log_state": int(self.log.state),
            "log_free": self.log.free_bytes // _MIB,
            "uptime": int(uptime),
        }

    def _count(self) -> dict[str, int]:
        port = self.port.counters
        return {
            "n_cycles": self.monitor.n_cycles,
            "n_estimates": self.monitor.n_estimates,
            **asdict(self.monitor.counts),
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
            "latency_us": self.latency_ns // 1000,
        }
