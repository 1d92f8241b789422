"""A record of four seconds with as much noise as torque: a pendulum is named where there is one, and only there.

Of seeds 0 to 5 these three were missed while blocks voted. The same simulation without gravity is the case where
nothing is to be said.
"""

from __future__ import annotations

from types import ModuleType

import pytest

from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

SEEDS = (0, 2, 3)


@pytest.fixture(scope="module")
def short_pendulum(support) -> ModuleType:
    return support("short_pendulum")


def balance_of(module, seed, **hidden):
    build = module.Pendulum(**hidden)
    plant = AxisPlant(RotaryAxis.model_validate(module.plant(build)), [module.record(build, seed)])
    return describe(plant.balance, linear=False)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_pendulum_is_named_in_a_short_noisy_record_with_its_gravity(short_pendulum, seed):
    found = balance_of(short_pendulum, seed)
    (term,) = found["terms"]
    gravity, inertia = term["parameters"]["amplitude"], found["base"]["inertia"]
    assert term["name"] == "pendulum"
    assert gravity["low"] < 2.9 < gravity["high"]
    assert inertia["low"] < 0.14 < inertia["high"]


@pytest.mark.parametrize("seed", SEEDS)
def test_without_gravity_the_same_record_needs_no_law(short_pendulum, seed):
    found = balance_of(short_pendulum, seed, G=0.0)
    assert found["terms"] == []
    assert found["base"]["inertia"]["low"] < 0.14 < found["base"]["inertia"]["high"]
