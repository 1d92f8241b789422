from __future__ import annotations

import numpy as np
import pytest

from ema.core import config, resources
from ema.identification.alignment import alignment
from ema.models import hf
from ema.models.actuator import Actuator

PLANT = config.load(resources.config("actuator.yaml"), Actuator)


def turned(theta_0: float) -> Actuator:
    data = PLANT.model_dump()
    data["motor"]["theta_0"] = theta_0
    return Actuator.model_validate(data)


@pytest.mark.parametrize("theta_0", [-2.5, -np.pi / 2, 0.0, 0.4, np.pi / 2, 3.0])
@pytest.mark.parametrize("k", [(0, 0, 0, 0, 0, 0), (0.3, 0.2, 0.2, 0, 0.1, 0.2)])
def test_the_rotor_zero_is_found(theta_0, k):
    r = hf.simulate(turned(theta_0), np.array(k), seeds=3)
    found = alignment(r.i, r.theta_m, PLANT.motor.p, PLANT.control.rate)
    assert np.angle(np.exp(1j * (found.theta_0 - theta_0))) == pytest.approx(0.0, abs=0.12)
    assert not found.reversed_order
    assert found.coherence > 0.7


def test_exchanged_phases_are_found():
    r = hf.simulate(turned(0.4), np.zeros(6), seeds=3)
    found = alignment(r.i[:, [0, 2, 1]], r.theta_m, PLANT.motor.p, PLANT.control.rate)
    assert found.reversed_order
    assert found.theta_0 == pytest.approx(0.4, abs=0.12)


def test_currents_that_do_not_follow_the_rotor_say_so():
    noise = np.random.default_rng(1).standard_normal((1, 3, 5001))
    r = hf.simulate(PLANT, np.zeros(6), seeds=3)
    assert alignment(noise, r.theta_m, PLANT.motor.p, PLANT.control.rate).coherence < 0.2
