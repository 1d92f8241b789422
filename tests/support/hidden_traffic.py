"""Cycles of the independent actuator as the frames that a real one would send."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace

import numpy as np
from ema_simulator.fleet import CycleData
from ema_simulator.traffic import Traffic

PERIOD = 1.0  # [s] from one test cycle to the next
EPOCH_NS = 1_700_000_000_000_000_000
ROOM = 20.0  # °C


def frames(cycles: Iterable[dict[str, np.ndarray]], codec: object) -> np.ndarray:
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
