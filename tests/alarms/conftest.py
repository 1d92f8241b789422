from __future__ import annotations

import numpy as np
import pytest

from ema.alarms import AlarmSettings, Judged
from ema.core import config, resources
from ema.core.status import Reason, Status

T0 = 1_741_943_700_000_000_000
SECOND = 1_000_000_000
NOTHING = Reason(0)


@pytest.fixture(scope="session")
def settings():
    return config.load(resources.config("alarms.yaml"), AlarmSettings)


@pytest.fixture
def judged():
    """An estimate of one cycle a second, of actuator 0."""

    def make(cycle, actuator=0, sd=0.002, status=Status.VALID, reasons=NOTHING, **faults):
        k = np.array([faults.get(f"k{j}", 0.0) for j in range(1, 7)])
        return Judged(T0 + cycle * SECOND, actuator, cycle, k, np.full(6, sd), status, reasons)

    return make
