"""A pendulum behind a gear, of which the motor's angle is recorded: a pendulum, and no spring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.discrepancy.axis.balance.telling.as_effects import effects
from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models import axis
from ema.models.axis_config import RotaryAxis

GEAR = 20.0


def test_its_gravity_is_told_at_the_motor_with_the_turns_of_the_load(support):
    module = support("short_pendulum")
    build = module.Pendulum(noise=0.2, spikes=0.0, speed_noise=0.05)
    record = module.record(build, 1, seconds=3.0, hz=200.0)
    (cycle,) = record
    channels = {**cycle.channels, "theta_m": GEAR * cycle["theta_m"], "w_m": GEAR * cycle["w_m"]}
    file = {**module.plant(build), "J": build.J / GEAR**2, "F_d": build.F / GEAR, "gear": GEAR, "torque_at": "load"}
    plant = AxisPlant(RotaryAxis.model_validate(file), [replace(record, cycles=(replace(cycle, channels=channels),))])
    (term,) = describe(plant.balance, linear=False)["terms"]
    gravity = term["parameters"]["amplitude"]
    assert term["name"] == "pendulum"
    assert term["confidence"] > 0.9
    assert gravity["low"] < build.G / GEAR < gravity["high"]
    assert gravity["value"] == pytest.approx(build.G / GEAR, rel=0.05)
    assert "20 of this side" in term["sentence"]
    (found,) = plant.balance.terms
    point = effects(plant.balance, found)["pendulum"]
    along = np.linspace(-30.0, 30.0, 7)
    zero = np.zeros(7)
    plain, hung = (
        axis.torque_along(axis.model(plant.plant, of), along, zero, zero, zero, zero)
        for of in ({}, {"pendulum": point})
    )
    assert plain - hung == pytest.approx(point["amplitude"] * np.sin(along / GEAR + point["phase"]), abs=1e-9)
