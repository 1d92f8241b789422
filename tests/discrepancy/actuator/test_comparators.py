"""The grid on which comparators switch: steps of which a whole number makes a control period."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.finding.verdicts import settle_at_minimum
from ema.discrepancy.actuator.fitting import comparators
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.comparators import (
    TRIED,
    find_delay,
    find_step,
    is_coarse,
    take_step,
    tell_step,
    weigh_delay,
)
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Search
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import NOISE_STEPS, STEPS, EmaPlant


@pytest.fixture
def plant(shipped_plant):
    return SimpleNamespace(plant=shipped_plant, step=None, steps=(), noise_steps=(), neutral=lambda name: 0.0)


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


def test_a_delay_is_looked_for_where_legs_switch_later_than_by_the_usual_steps(plant, monkeypatch):
    """A step makes legs late by half of it on average, a fit of the delay begins there or near."""
    asked = []

    def misfit_at(plant, noise, point, cycles, steps=None):
        asked.append(steps)
        return 1.0 + abs(point["comparator_delay.time"] / 9e-7 - 1.0)

    monkeypatch.setattr(comparators, "misfit_at", misfit_at)
    assert [is_coarse(step) for step in (5e-7, 1e-6, 2e-6)] == [False, False, True]
    assert find_delay(plant, None, {"k1": 0.02}, [0], 2e-6) == {"k1": 0.02, "comparator_delay.time": 1e-6}
    assert set(asked) == {STEPS}


def test_a_delay_and_a_step_are_weighed_by_the_noise_of_both(plant, monkeypatch):
    """Each noise counts with what it makes of a record."""

    def misfit_at(plant, noise, point, cycles, steps=None):
        return noise.least + (0.02 if steps == (2e-6,) else 0.0)

    monkeypatch.setattr(comparators, "misfit_at", misfit_at)
    noises = [SimpleNamespace(least=x, expected=lambda cycles, n=n: n) for x, n in ((1.0, 1000.0), (1.2, 3000.0))]
    assert weigh_delay(plant, noises, {}, {}, 2e-6, [0]) == pytest.approx(20.0)


@pytest.mark.parametrize("about", TRIED)
def test_a_step_and_its_neighbours_divide_a_control_period(plant, about):
    take_step(plant, about)
    for step in plant.noise_steps:
        n = 1.0 / (plant.plant.control.rate * step)
        assert n == pytest.approx(round(n), abs=1e-9)
    assert plant.steps == (about,)
    take_step(plant, None)
    assert (plant.steps, plant.noise_steps) == (STEPS, NOISE_STEPS)


def hiding_a_load(hidden, plant, substeps, **flaws):
    """A search on a record of another simulator with a load, near the truth but for what is to be told."""
    bench = hidden.BENCH._replace(substeps=substeps)
    cycles = hidden.cycles(hidden.Flaws(load=3.0, k5=0.05, **flaws), 4, 11, bench=bench)
    data = prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    ema, start = EmaPlant(plant, data, 1), {"k5": 0.05, "constant_load.torque": 3.0}
    search = Search(ema, Noise(ema, start), *split(data))
    load = next(c for c in candidates(plant, data, []) if c.effect == "constant_load")
    model = search.model((load,), (*K_FREE, *load.frees), start, None, 2)
    return search, model, search.verdict(model)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("substeps", "own"), [(100, 1e-6), pytest.param(200, 5e-7, marks=pytest.mark.further, id="further")]
)
def test_legs_that_follow_late_are_no_coarser_step(hidden, shipped_plant, substeps, own):
    """A delay of 0.6 µs beside a load had been told as comparators evaluated every 2 µs."""
    search, model, v = hiding_a_load(hidden, shipped_plant, substeps, reaction=6e-7)
    assert tell_step(search.plant, search.noise, model.fit.point, search.train) == pytest.approx(2e-6)
    alike = [("asymmetric_friction",)]
    found, w = settle_at_minimum(search, model, v, alike)
    assert found.names == ("constant_load", "comparator_delay")
    assert alike == [("asymmetric_friction",), ()]
    assert w.is_noise
    assert found.fit.point["comparator_delay.time"] == pytest.approx(
        6e-7, abs=3.0 * found.fit.sd["comparator_delay.time"]
    )
    assert found.fit.sd["comparator_delay.time"] < 1.5e-7
    assert search.plant.step == pytest.approx(own)


@pytest.mark.slow
def test_a_coarser_step_is_no_leg_that_follows_late(hidden, shipped_plant):
    search, model, v = hiding_a_load(hidden, shipped_plant, 50)
    alike = [()]
    found, w = settle_at_minimum(search, model, v, alike)
    assert (found.names, alike) == (("constant_load",), [()])
    assert search.plant.step == pytest.approx(2e-6)
    assert w.is_noise
