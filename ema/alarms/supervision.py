"""From what the monitor says of itself in a heartbeat, as it is logged, to the conditions of its alarms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ema.core.status import LogState

from .causes import BEHIND, BUS, CHANNEL, LOG, SECOND, SILENT

_OF_LAPSE = {
    "bus_down": BUS, "bus_off": BUS, "error_passive": BUS, "flooded": BUS, "frames": BUS,
    "log": LOG, "worker": BEHIND, "no_estimate": BEHIND, "second_monitor": SECOND, "channel": CHANNEL,
    "silent": SILENT, "no_cycles": SILENT, "no_currents": SILENT, "no_motion": SILENT, "no_supply": SILENT,
}  # fmt: skip
_OF_MONITOR = (BUS, LOG, BEHIND)


def conditions(status: Mapping[str, Any]) -> dict[tuple[int | None, str], bool]:
    """Which alarms of supervision hold by the content of a status message (`ema.log.schemas.STATUS`)."""
    found: dict[tuple[int | None, str], bool] = {}
    if status.get("log_state") in (LogState.FULL.name.lower(), LogState.FAILED.name.lower()):
        found[None, LOG.name] = True
    for lapse in status.get("lapses", ()):
        cause = _OF_LAPSE.get(lapse["reason"])
        if cause is not None:
            found[None if cause in _OF_MONITOR else lapse["actuator"], cause.name] = True
    return found
