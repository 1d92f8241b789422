"""Where answers go: onto the bus, into the log, and as lines for people."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from ema.bus.codec import Codec
from ema.bus.port import Port
from ema.bus.protection import Sender
from ema.core.status import ServiceState
from ema.log import LogWriter
from ema.monitor import Event, Identified, Level, SampledEnvelope

logger = logging.getLogger("ema.daemon")
_LEVELS = {Level.INFO: logging.INFO, Level.WARNING: logging.WARNING, Level.ERROR: logging.ERROR}
_NO_LIMIT = 1e9  # clipped by the codec to the largest value, which means "that much or more"


class BusSink:
    """Sends estimates and heartbeats."""

    def __init__(self, port: Port, codec: Codec):
        self._port, self._codec = port, codec
        self._sender = Sender()

    def estimate(self, out: Identified) -> None:
        """One frame for each estimate, at once."""
        e = out.estimate
        residual = e.residual[np.isfinite(e.residual)]
        values = {
            "cycle": out.cycle,
            "k": np.nan_to_num(e.k, nan=0.0)[None],
            "sd_k": np.nan_to_num(e.sd, nan=_NO_LIMIT)[None],
            "status": int(e.status),
            "reason": int(e.reasons),
            "p_value": np.nan_to_num(e.p_value, nan=0.0),
            "residual": np.sqrt(np.mean(residual**2)) if residual.size else _NO_LIMIT,
        }
        self._send(f"Estimate{e.method.capitalize()}", out.actuator, values, out.t_ns)

    def heartbeat(self, values: dict[str, Any], t_ns: int) -> None:
        """The sign of life."""
        self._send("Heartbeat", 0, values, t_ns)

    def _send(self, name: str, actuator: int, values: dict[str, Any], t_ns: int) -> None:
        self._port.write(self._sender.protect(self._codec.encode(name, actuator, values, t_ns)))


class LogSink:
    """Writes answers to the log, see `ema.log.schemas`."""

    def __init__(self, log: LogWriter):
        self._log = log

    def estimate(self, out: Identified) -> None:
        """One message for each estimate."""
        e = out.estimate
        self._log.estimate(
            {
                "t_ns": out.t_ns,
                "actuator": out.actuator,
                "method": e.method,
                "cycle": out.cycle,
                "status": e.status.name.lower(),
                "reasons": e.reasons.names,
                "k": e.k,
                "sd": e.sd,
                "p_value": e.p_value,
            }
        )

    def envelope(self, out: SampledEnvelope) -> None:
        """Envelope at the schedule."""
        self._log.envelope(
            {
                "t_ns": out.t_ns,
                "actuator": out.actuator,
                "cycle": out.cycle,
                "t": out.t,
                "measured": out.measured,
                "model": out.model,
                "sd": out.sd,
            }
        )

    def event(self, event: Event) -> None:
        """An event, here and as a line of the service's journal."""
        whose = "" if event.actuator is None else f"actuator {event.actuator}: "
        logger.log(_LEVELS[event.level], "%s%s", whose, event.text)
        self._log.event(
            {
                "t_ns": event.t_ns,
                "level": event.level.value,
                "code": event.code,
                "text": event.text,
                "actuator": event.actuator,
            }
        )

    def status(self, state: ServiceState, uptime: float, counters: dict[str, int], t_ns: int) -> None:
        """A copy of the heartbeat."""
        self._log.status(
            {
                "t_ns": t_ns,
                "state": state.name.lower(),
                "uptime": uptime,
                "log_state": self._log.state.name.lower(),
                "log_free": self._log.free_bytes,
                "counters": counters,
            }
        )
