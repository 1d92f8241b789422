"""Where answers go: onto the bus, into the log, and as lines for people."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Any

import numpy as np

from ema.bus.codec import Codec
from ema.bus.protection import Sender
from ema.core.status import ServiceState
from ema.identification import NuisanceEstimate
from ema.log import LogWriter, contents
from ema.monitor import Event, Identified, Level, SampledEnvelope
from ema.monitor.supervision import Promise

from .identity import Identity
from .voice import Voice

logger = logging.getLogger("ema.daemon")
_LEVELS = {Level.INFO: logging.INFO, Level.WARNING: logging.WARNING, Level.ERROR: logging.ERROR}
_NO_LIMIT = 1e9  # clipped by the codec to the largest value, which means "that much or more"


def estimate_message(method: str) -> str:
    """Name of the DBC message that carries an identifier's estimates."""
    return f"Estimate{method.capitalize()}"


class BusSink:
    """Sends estimates and heartbeats."""

    def __init__(self, voice: Voice, codec: Codec):
        self._voice, self._codec = voice, codec
        self._sender = Sender()

    def estimate(self, out: Identified, age: float) -> None:
        """One frame for each estimate, at once; `age` is that since the cycle's last sample. [s]"""
        e = out.estimate
        residual = contents.rms(e.residual)
        values = {
            "cycle": out.cycle,
            "k": np.nan_to_num(e.k, nan=0.0)[None],
            "sd_k": np.nan_to_num(e.sd, nan=_NO_LIMIT)[None],
            "status": int(e.status),
            "reason": int(e.reasons),
            "p_value": np.nan_to_num(e.p_value, nan=0.0),
            "residual": _NO_LIMIT if residual is None else residual,
            "age": age,
        }
        self._send(estimate_message(e.method), out.actuator, values, out.t_ns)
        if e.nuisance is not None:
            self._nuisance(out, e.nuisance)

    def _nuisance(self, out: Identified, beside: NuisanceEstimate) -> None:
        """One frame for each parameter estimated beside the faults; what the DBC has no number for is only logged."""
        fields = self._codec.messages["EstimateNuisance"].fields
        methods, parameters = ({name: n for n, name in fields[f].names.items()} for f in ("method", "parameter"))
        known = np.array([name in parameters for name in beside.names])
        if known.any():
            low, high = beside.interval95[known].T
            values = {
                "cycle": out.cycle,
                "method": methods[out.estimate.method],
                "status": int(out.estimate.status),
                "parameter": np.array([parameters[name] for name in beside.names if name in parameters]),
                **{"value": beside.value[known], "sd": beside.sd[known], "low": low, "high": high},
            }
            self._send("EstimateNuisance", out.actuator, values, out.t_ns)

    def identification(self, identity: Identity, t_ns: int) -> None:
        """What makes the estimates, one frame for each actuator."""
        for actuator in identity.bundles:
            self._send("Identification", actuator, identity.signals(actuator), t_ns)

    def heartbeat(self, values: dict[str, Any], supervision: dict[str, Any], t_ns: int) -> None:
        """The sign of life, and beside it everything that does not happen."""
        self._send("Heartbeat", 0, values, t_ns)
        self._send("Supervision", 0, {name: np.uint64(bits) for name, bits in supervision.items()}, t_ns)

    def _send(self, name: str, actuator: int, values: dict[str, Any], t_ns: int) -> None:
        self._voice.write(self._sender.protect(self._codec.encode(name, actuator, values, t_ns)))


class LogSink:
    """Writes answers to the log, see `ema.log.schemas`."""

    def __init__(self, log: LogWriter):
        self._log = log

    def estimate(self, out: Identified, age: float) -> None:
        """One message for each estimate; `age` is that at its sending. [s]"""
        self._log.estimate(contents.estimate(out.t_ns, out.actuator, out.cycle, out.estimate, age))
        for content in contents.nuisance(out.t_ns, out.actuator, out.cycle, out.estimate):
            self._log.nuisance(content)

    def envelope(self, out: SampledEnvelope) -> None:
        """Envelope at the schedule."""
        values = out.t, out.measured, out.model, out.sd
        self._log.envelope(contents.envelope(out.t_ns, out.actuator, out.cycle, *values))

    def event(self, event: Event) -> None:
        """An event, here and as a line of the service's journal."""
        whose = "" if event.actuator is None else f"actuator {event.actuator}: "
        logger.log(_LEVELS[event.level], "%s%s", whose, event.text)
        self._log.event(contents.event(event.t_ns, event.level.value, event.code, event.text, event.actuator))

    def status(
        self, state: ServiceState, uptime: float, counters: dict[str, int], lapses: Iterable[Promise], t_ns: int
    ) -> dict[str, Any]:
        """A copy of the heartbeat, which is returned as logged."""
        log = self._log
        content = contents.status(t_ns, state, uptime, log.state, log.free_bytes, counters, lapses)
        log.status(content)
        return content
