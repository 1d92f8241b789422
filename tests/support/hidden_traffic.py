"""Cycles of the independent actuator as the frames that a real one would send, and what a monitor says of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from ema_postflight.series import SeverityTrack
from ema_simulator.fleet import CycleData
from ema_simulator.traffic import Traffic

from ema.alarms import AlarmSettings
from ema.bundle import Bundle
from ema.bus import codec as codecs
from ema.bus.codec import Codec
from ema.core import config, resources
from ema.core.names import FAULTS
from ema.core.status import Reason
from ema.identification import Estimate
from ema.monitor import Event, Identified, Monitor, MonitorSettings, Runner, answers

PERIOD = 1.0  # [s] from one test cycle to the next
SHORT = 0.03  # of k3, k4, k5, from which a short counts here [1]
EPOCH_NS = 1_700_000_000_000_000_000
ROOM = 20.0  # °C


def frames(cycles: Iterable[dict[str, np.ndarray]], codec: Codec) -> np.ndarray:
    """Frames of actuator 0 in the order and with the times of their reception; `cycles` by `hidden_actuator.cycles`."""
    traffic, parts = Traffic(codec, [0]), []
    for number, c in enumerate(cycles):
        channels = {name: c[name][None] for name in ("theta_m", "theta_u", "u_dc")}
        response = SimpleNamespace(i=np.array([[c["i_a"], c["i_b"], c["i_c"]]]), **channels)
        t_start, temp_w = number * PERIOD, np.array([ROOM])
        data = CycleData(number, t_start, c["t"], np.zeros((1, 6)), temp_w, c["theta_cmd"], response)
        sent, due = traffic.frames(data, PERIOD)
        sent["t_ns"] = EPOCH_NS + np.round(1e9 * (t_start + due)).astype(np.int64)
        parts.append(sent)
    return np.concatenate(parts)


class Watched(NamedTuple):
    """What a monitor said of a flight of actuator 0."""

    estimates: list[Estimate]  # by the method asked for, with the monitor's reasons
    events: list[Event]

    @property
    def doubted(self) -> np.ndarray:
        """Whether each estimate is marked ``model in doubt``, shape (n,)."""
        return np.array([bool(e.reasons & Reason.MODEL_IN_DOUBT) for e in self.estimates])

    def alarms(self, k: Sequence[float]) -> list[str]:
        """Faults that are worth watching at the end of the flight, and are not there; shorts from SHORT on.

        The shipped thresholds are chosen so that a usual spread of magnets alarms nobody; here is asked what is read.
        """
        settings = _watching_shorts(config.load(resources.config("alarms.yaml"), AlarmSettings))
        found = []
        for j, fault in enumerate(FAULTS):
            track = SeverityTrack(fault, settings)
            for e in self.estimates:
                track.add(float(e.k[j]), float(e.sd[j]))
            if track.severity and k[j] < settings.faults[fault].watch:
                found.append(fault)
        return found


def _watching_shorts(shipped: AlarmSettings) -> AlarmSettings:
    shorts = {name: shipped.faults[name].model_copy(update={"watch": SHORT}) for name in ("k3", "k4", "k5")}
    return shipped.model_copy(update={"faults": {**shipped.faults, **shorts}})


def watched(bundle: Bundle, cycles: Iterable[dict[str, np.ndarray]], method: str = "lf2") -> Watched:
    """A flight as the daemon's monitor sees it, with `method` asked in every cycle."""
    shared = codecs.default()
    settings = MonitorSettings.model_validate({"slower": {method: {"every": PERIOD / 2}}})
    monitor, runner = Monitor({0: bundle}, shared, settings), Runner({0: bundle})
    said = list(answers([frames(cycles, shared)], monitor, runner))
    estimates = [o.estimate for o in said if isinstance(o, Identified) and o.estimate.method == method]
    return Watched(estimates, [o for o in said if isinstance(o, Event)])
