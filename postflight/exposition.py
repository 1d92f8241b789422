"""What a listener knows of the bus as Prometheus metrics. No I/O, no clock but the one given."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from enum import IntEnum
from pathlib import Path
from threading import Lock

import numpy as np
from prometheus_client import CollectorRegistry, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from ema.bus.codec import Codec
from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, LogState, ServiceState, Status

from .live import SILENT_AFTER, Live, Shown

DEVIATIONS = 1.96  # of the interval's ends: 95 %
_BUCKETS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # [s]
_COUNTED = {
    "n_cycles": ("cycles", "test cycles seen"),
    "n_estimates": ("estimates", "test cycles with an estimate that is valid or degraded"),
    "n_lost": ("frames_lost", "frames missing from their sequence"),
    "n_repeated": ("frames_repeated", "frames received again"),
    "n_reordered": ("frames_late", "frames that came late"),
    "n_crc_error": ("frames_crc_error", "frames with a wrong CRC"),
    "n_wrong_counter": ("frames_wrong_counter", "frames far off their sequence"),
    "n_wrong_length": ("frames_wrong_length", "frames of another length or format"),
    "n_timeout": ("timeouts", "times that something expected did not come"),
    "n_foreign": ("frames_foreign", "frames with an identifier of others"),
    "n_refused": ("frames_refused", "frames refused by message authentication"),
    "kernel_drops": ("frames_dropped", "frames the kernel dropped"),
}
_MIB = 1 << 20


class Exposition(Collector):
    """Metrics of the monitor on a bus, made when they are asked for.

    Parameters
    ----------
    codec : Codec
    registry : CollectorRegistry
    now_ns : callable
        Time since the Unix epoch. [ns]
    pid : int, optional
        The monitor's process, if it runs on this machine: its memory.
    """

    def __init__(self, codec: Codec, registry: CollectorRegistry, now_ns: Callable[[], int], pid: int | None = None):
        self._latency = Histogram(
            "ema_estimate_latency_seconds", "from a cycle's last sample to the sending of its estimate",
            ["method"], buckets=_BUCKETS, registry=registry,
        )  # fmt: skip
        self._live = Live(codec, on_estimate=self._sent)
        self._lock, self._now_ns, self._pid = Lock(), now_ns, pid
        registry.register(self)

    def update(self, frames: np.ndarray) -> None:
        """Take frames in the order received, shape (n,), FRAME_DTYPE."""
        with self._lock:
            self._live.update(frames)

    def collect(self) -> Iterable[Metric]:
        """See prometheus_client."""
        with self._lock:
            now_ns = self._now_ns()
            return [*self._estimates(now_ns), *self._alarms(now_ns), *self._heartbeat(now_ns)]

    def _sent(self, method: str, shown: Shown) -> None:
        self._latency.labels(method).observe(shown.latency)

    def _estimates(self, now_ns: int) -> Iterator[Metric]:
        who = ["actuator", "method"]
        k = GaugeMetricFamily("ema_k", "fault, 0 healthy … 1 complete failure", labels=[*who, "fault"])
        low = GaugeMetricFamily("ema_k_low", "lower end of the fault's interval of 95 %", labels=[*who, "fault"])
        high = GaugeMetricFamily("ema_k_high", "upper end of the fault's interval of 95 %", labels=[*who, "fault"])
        status = GaugeMetricFamily("ema_estimate_status", "1 for the status it has", labels=[*who, "status"])
        age = GaugeMetricFamily("ema_estimate_age_seconds", "since the last estimate was sent", labels=who)
        cycle = GaugeMetricFamily("ema_estimate_cycle", "its test cycle", labels=who)
        for (number, method), one in sorted(self._live.estimates.items()):
            own = [str(number), method]
            if one.status <= Status.DEGRADED:
                for fault, value, sd in zip(FAULTS, one.k.tolist(), one.sd.tolist(), strict=True):
                    k.add_metric([*own, fault], value)
                    low.add_metric([*own, fault], max(0.0, value - DEVIATIONS * sd))
                    high.add_metric([*own, fault], min(1.0, value + DEVIATIONS * sd))
            _states(status, own, Status, one.status)
            age.add_metric(own, (now_ns - one.t_ns) / 1e9)
            cycle.add_metric(own, one.cycle)
        yield from (k, low, high, status, age, cycle)

    def _alarms(self, now_ns: int) -> Iterator[Metric]:
        labels = ["actuator", "cause", "level", "state"]
        each = GaugeMetricFamily("ema_alarm", "1 for each alarm that is not inactive", labels=labels)
        count = GaugeMetricFamily("ema_alarms", "alarms that are not inactive", labels=["level"])
        known = self._live.alarms.known(now_ns)
        for change in known:
            whose = "monitor" if change.actuator is None else str(change.actuator)
            each.add_metric([whose, change.cause, change.level.name.lower(), change.state.name.lower()], 1.0)
        for level in list(AlarmLevel)[1:]:
            count.add_metric([level.name.lower()], sum(change.level == level for change in known))
        yield from (each, count)

    def _heartbeat(self, now_ns: int) -> Iterator[Metric]:
        beat, heard_ns = self._live.heartbeat, self._live.heard_ns
        age = (now_ns - heard_ns) / 1e9 if heard_ns else np.inf
        yield GaugeMetricFamily("ema_up", "whether the monitor's heartbeat comes", value=float(age <= SILENT_AFTER))
        yield GaugeMetricFamily("ema_heartbeat_age_seconds", "since the last heartbeat", value=age)
        if self._pid is not None:
            size = _resident(self._pid)
            yield GaugeMetricFamily("ema_resident_memory_bytes", "of the monitor's process", value=size)
        if not beat:
            return
        for name, kind, states in (("state", "the monitor's", ServiceState), ("log_state", "the log's", LogState)):
            family = GaugeMetricFamily(f"ema_{name}", f"1 for {kind} state", labels=["state"])
            _states(family, [], states, beat[name])
            yield family
        yield GaugeMetricFamily("ema_uptime_seconds", "since the monitor started", value=beat["uptime"])
        yield GaugeMetricFamily("ema_log_free_bytes", "free where the log is written", value=beat["log_free"] * _MIB)
        for signal, (name, meaning) in _COUNTED.items():
            yield CounterMetricFamily(f"ema_{name}", meaning, value=beat[signal])


def _states(family: GaugeMetricFamily, labels: list[str], kind: type[IntEnum], value: int) -> None:
    for state in kind:
        family.add_metric([*labels, state.name.lower()], float(state == value))


def _resident(pid: int) -> float:
    """Resident memory of a process, NaN when it is gone. [B]"""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
        return 1024.0 * next(float(line.split()[1]) for line in lines if line.startswith("VmRSS:"))
    except (OSError, StopIteration, ValueError):
        return np.nan
