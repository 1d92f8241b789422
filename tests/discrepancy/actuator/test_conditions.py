"""Conditions of a record are one value: what a search leaves behind is given back whole."""

from __future__ import annotations

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.comparators import take_step
from ema.discrepancy.actuator.fitting.conditions import Conditions
from ema.discrepancy.actuator.fitting.zeros import take_zero
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.plant import NOISE_STEPS, STEPS, EmaPlant


def test_conditions_taken_on_the_way_are_given_back(hidden, shipped_plant):
    cycles = hidden.cycles(hidden.Flaws(), 1, 3, (hidden.chirp(),))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data, 1)
    before = Conditions.of(plant)
    runs = plant.simulate([{}], [0], [1])
    plant.late = 2
    take_step(plant, 2e-6)
    take_zero(plant, 1e-4)
    assert Conditions.of(plant) == Conditions(2e-6, 2, 1e-4)
    other = plant.simulate([{}], [0], [1])
    assert (other.features != runs.features).any()
    before.take(plant)
    assert Conditions.of(plant) == before
    assert (plant.steps, plant.noise_steps) == (STEPS, NOISE_STEPS)
    assert (plant.simulate([{}], [0], [1]).features == runs.features).all()
