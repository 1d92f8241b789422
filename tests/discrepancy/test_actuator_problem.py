"""The actuator as the engine asks for it."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.problem import ActuatorProblem, as_cause, cost_of
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.engine.records import Pool, seeds


def problem(plant, made: Record) -> ActuatorProblem:
    return ActuatorProblem(EmaPlant(plant, prepare(plant, [made]), 2))


@pytest.fixture(scope="module")
def short(hidden, shipped_plant) -> ActuatorProblem:
    cycles = hidden.cycles(hidden.Flaws(), 2, 3, motions=(hidden.chirp(duration=0.25),))
    return problem(shipped_plant, Record(tuple(Cycle(n, c) for n, c in enumerate(cycles))))


def test_blocks_cover_the_record_and_cycles_of_one_motion_share_their_noise(short):
    covered = np.concatenate([np.arange(len(short.measured))[block.at] for block in short.blocks])
    np.testing.assert_array_equal(covered, np.arange(len(short.measured)))
    assert {block.kind for block in short.blocks} == {0}
    assert short.floors.shape == short.measured.shape


def test_points_share_their_seeds_and_a_gain_of_the_recorder_is_what_it_says(short):
    points = [{}, {"recorder_gain.gain_a": 0.05}]
    x = short.records(points, seeds(Pool.COLUMN, 3))
    assert x.shape == (2, 3, len(short.measured))
    change = x[1, 0] - x[0, 0]
    assert np.abs(change).max() > 0.01
    (at,) = [slices["tracking"] for slices in short.plant.slices]
    np.testing.assert_allclose(change[short.at[0]][at], 0.0, atol=1e-12)  # the motion stays as it is


def test_causes_are_the_library_with_sizes_within_what_is_credible(short):
    causes = {c.name: c for c in map(as_cause, candidates(short.plant.plant, short.plant.data, ()))}
    assert {"recorder_gain", "current_gain", "controller_delay", "position_delay", "magnet_flux"} <= set(causes)
    for c in causes.values():
        assert 0.0 < c.prior < 1.0
        for p in c.parameters:
            assert p.low <= p.neutral <= p.high
            assert p.usual > 0.0


def test_an_effect_costs_its_rarity_and_the_sizes_it_might_have_had_and_never_less_than_its_rarity(short):
    late = next(c for c in candidates(short.plant.plant, short.plant.data, ()) if c.effect == "comparator_delay")
    (time,) = as_cause(late).parameters
    costs = [cost_of(late, {time.name: share * time.usual}) for share in (0.01, 0.1, 1.0, 10.0)]
    assert costs[0] - costs[1] == pytest.approx(np.log(10.0))
    assert costs[1] - costs[2] == pytest.approx(np.log(10.0))
    assert costs[2] == costs[3] == pytest.approx(np.log(49.0))  # one in fifty
