"""Simulated cycles as a record, instead of on a bus."""

from __future__ import annotations

import numpy as np

from ema.core.names import CURRENTS
from ema.core.records import Cycle

from .fleet import CycleData


def to_cycle(data: CycleData, lane: int) -> Cycle:
    """The measured channels of one actuator's cycle, all at the rate of the currents."""
    r = data.response
    return Cycle(
        data.number,
        {
            "t": data.t,
            **dict(zip(CURRENTS, r.i[lane], strict=True)),
            "theta_m": r.theta_m[lane],
            "theta_u": r.theta_u[lane],
            "theta_cmd": data.theta_cmd,
            "u_dc": r.u_dc[lane],
            "temp_w": np.full(data.t.size, data.temp_w[lane]),
        },
    )
