"""The recommended recording is simulated, not written down: it must be the one that physics says."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Model, Search
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.actuator.telling.motions import motions
from ema.discrepancy.actuator.telling.next_recording import THE_SAME, next_recording


@pytest.fixture(scope="module")
def recorded(hidden, shipped_plant):
    """A search on two cycles of a small motion far from the middle, with a spring that pulls there."""
    cycles = hidden.cycles(hidden.Flaws(spring=100.0), 2, 5, (hidden.chirp(2e-3),), hidden.Bench(position=0.05))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data)
    return Search(plant, Noise(plant, {}), *split(data))


@pytest.fixture(scope="module")
def spring(recorded):
    return fitted(recorded, "spring_load", 100.0)


def fitted(search, effect, start):
    c = next(c for c in candidates(search.plant.plant, search.plant.data, ()) if c.effect == effect)
    return search.model([c], (*K_FREE, *c.frees), {c.frees[0].name: start}, None, 2)


@pytest.mark.slow
def test_a_spring_is_told_from_a_constant_load_by_going_elsewhere(recorded, spring):
    load = fitted(recorded, "constant_load", 5.0)
    found = next_recording(recorded, spring, [(load.names[0],)], [])
    assert found["between"] == [["spring_load"], ["constant_load"]]
    best, *others = found["motions"]
    assert "away from where it was recorded" in best["motion"]
    assert best["shows_in"] == "torque"
    assert best["deviations"] > 3.0 * others[0]["deviations"]
    (again,) = (row for row in others if row["motion"] == THE_SAME)
    assert f"{again['deviations']:.1f}" in found["sentence"]


@pytest.mark.slow
def test_what_is_one_law_no_motion_tells_apart(recorded, spring):
    """The rival is the same spring under another name, a ten-thousandth stiffer: what is promised is chance."""
    stiffer = {**spring.fit.point, "spring_load.stiffness": 1.0001 * spring.fit.point["spring_load.stiffness"]}
    twin = Model((replace(spring.effects[0], effect="inertia"),), replace(spring.fit, point=stiffer), spring.heldout)
    recorded.tried.append(twin)
    found = next_recording(recorded, spring, [("inertia",)], [])
    assert found["sentence"].startswith("None of")
    assert all(row["deviations"] ** 2 < 3.0 * row["deviations_by_chance"] ** 2 for row in found["motions"])


def test_nothing_is_recommended_where_nothing_is_left_to_be_told_apart(recorded, spring):
    far_behind = {"effects": ["constant_load"], "nats_behind": 50.0}
    assert next_recording(recorded, spring, [()], [far_behind]) == {}


def test_no_motion_leaves_the_travel(shipped_plant):
    stop = shipped_plant.transmission.theta_stop
    for centre in (-0.9 * stop, 0.0, 0.9 * stop):
        assert all(abs(m.command).max() < stop for m in motions(shipped_plant, centre))
