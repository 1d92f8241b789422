"""The actuator as the engine asks for it, and what one look at records of another hand promises."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.foreign import record, truths
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.cycles import measured
from ema.discrepancy.actuator.plant import EmaPlant
from ema.discrepancy.actuator.problem import ActuatorProblem
from ema.discrepancy.engine.hypothesis import Hypothesis
from ema.discrepancy.engine.moves import moves
from ema.discrepancy.engine.records import Pool, seeds
from ema.discrepancy.engine.weighing import Budget, Scale
from ema.effects import registry

GLANCE = Budget(records=32, column_seeds=4, fit_seeds=4)


def problem(plant, made: Record) -> ActuatorProblem:
    return ActuatorProblem(EmaPlant(plant, measured(plant, [made]), 2))


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
    change = short.differences({}, points[1:], seeds(Pool.COLUMN, 4))[0]
    assert np.abs(change).max() > 0.01
    (at,) = [slices["tracking"] for slices in short.plant.slices]
    np.testing.assert_allclose(change[short.at[0]][at], 0.0, atol=1e-12)  # the motion stays as it is


def test_causes_are_the_library_with_bounds_and_faults_they_stand_for(short):
    causes = {c.name: c for c in short.causes}
    assert {"recorder_gain", "current_gain", "controller_delay", "position_delay", "magnet_flux"} <= set(causes)
    for c in causes.values():
        assert c.stands_for == registry()[c.name].mistaken_for
        for p in c.parameters:
            assert p.low <= p.neutral <= p.high
            assert p.usual > 0.0
    assert len(causes["stribeck"].starts) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["recorder_gain", "recorder_offset", "late_position"])
def test_at_a_glance_the_true_cause_of_a_record_of_another_hand_promises_most(shipped_plant, name):
    """One cycle of each motion, and first order where nothing acts: no search."""
    whole = record(name)
    p = problem(shipped_plant, Record(whole.cycles[:2]))
    scale = Scale(p, GLANCE, {})
    null = scale.weigh(Hypothesis(()))
    scale.learn_law_error(null)
    found = {move.cause: scale.promise(null, move.causes) for move in moves(null.hypothesis, p.causes, 1)}
    (true,) = {key.split(".")[0] for key in truths()[name]["hidden"]}
    assert max(found, key=lambda cause: found[cause]) == true
