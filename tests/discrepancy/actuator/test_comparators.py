"""The grid on which comparators switch: steps of which a whole number makes a control period."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator import comparators
from ema.discrepancy.actuator.comparators import TRIED, find_step, take_step, tell_step
from ema.discrepancy.actuator.cycles import prepare
from ema.discrepancy.actuator.noise import Noise
from ema.discrepancy.actuator.plant import NOISE_STEPS, STEPS, EmaPlant


@pytest.fixture
def plant(shipped_plant):
    return SimpleNamespace(plant=shipped_plant, step=None, steps=(), noise_steps=())


def seen(monkeypatch, true: float, now: float = 1.0, chance: float = 0.0):
    """A record whose comparators switch every `true` seconds: other steps leave more, the farther the more."""

    def excess_at(plant, noise, point, cycles, steps=None):
        return now if steps is None else min(now, chance + abs(steps[0] / true - 1.0))

    monkeypatch.setattr(comparators, "excess_at", excess_at)


@pytest.mark.parametrize("true", [1e-6, 1e-5])
def test_the_step_that_leaves_least_is_found(plant, monkeypatch, true):
    seen(monkeypatch, true)
    assert find_step(plant, None, {}, [0], share=0.7) == pytest.approx(true, rel=1e-9)


def test_where_no_step_leaves_clearly_less_there_is_none(plant, monkeypatch):
    seen(monkeypatch, 1e-6, chance=0.8)
    assert find_step(plant, None, {}, [0], share=0.7) is None


@pytest.mark.slow
@pytest.mark.parametrize(("substeps", "own"), [(100, 1e-6), (200, 5e-7)])
def test_the_pattern_of_the_currents_tells_a_fine_step(hidden, shipped_plant, substeps, own):
    """Of another simulator, that shares the step with ours and no line of code."""
    k = {"k1": 0.06, "k3": 0.05}
    bench = hidden.BENCH._replace(substeps=substeps)
    cycles = hidden.cycles(hidden.Flaws(**k), 2, 11, bench=bench)
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data, 1)
    near = {**k, "k4": 0.002}
    assert tell_step(plant, Noise(plant, near), near, [0, 1]) == pytest.approx(own, rel=1e-9)


@pytest.mark.parametrize("about", TRIED)
def test_a_step_and_its_neighbours_divide_a_control_period(plant, about):
    take_step(plant, about)
    for step in plant.noise_steps:
        n = 1.0 / (plant.plant.control.rate * step)
        assert n == pytest.approx(round(n), abs=1e-9)
    assert plant.steps == (about,)
    take_step(plant, None)
    assert (plant.steps, plant.noise_steps) == (STEPS, NOISE_STEPS)
