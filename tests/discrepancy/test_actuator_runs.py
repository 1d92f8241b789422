"""A run is simulated once, with whatever else fills its batch of lanes, and is the same to the last bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import STEPS, EmaPlant
from ema.discrepancy.actuator.simulating.runs import Asked, Memory, Runs

POINTS = (
    {},
    {"k1": 0.1},
    {"viscous_drag.coefficient": 5e-5},
    {"constant_load.torque": 2.0, "k3": 0.02},  # the same equations of the kernel as drag
    {"clock_skew.rate": 1e-4},
    {"recorder_gain.gain_a": 0.02},
)


@pytest.fixture(scope="module")
def data(hidden, shipped_plant):
    motions = (hidden.chirp(duration=0.22), hidden.chirp(duration=0.22, amplitude=0.006))
    return prepare(
        shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(hidden.cycles(hidden.Flaws(), 2, 3, motions))))]
    )


@pytest.mark.slow
def test_runs_do_not_depend_on_what_shares_their_batches(shipped_plant, data):
    together = EmaPlant(shipped_plant, data, 2).repeated(POINTS, [0, 1], 4, 50)
    for point, of in zip(POINTS, together, strict=True):
        alone = EmaPlant(shipped_plant, data, 1).repeated([point], [0, 1], 4, 50)[0]
        for cycle in (0, 1):
            np.testing.assert_array_equal(alone[cycle].features, of[cycle].features)
            np.testing.assert_array_equal(alone[cycle].envelopes, of[cycle].envelopes)


def test_what_was_simulated_is_not_simulated_again(shipped_plant, data):
    plant = EmaPlant(shipped_plant, data, 1)
    first = plant.means(POINTS[:2], [0], 4, 50)
    assert (plant.work.asked, plant.work.simulated) == (8, 8)
    assert plant.work.steps == 4 * 2200 * (100 + 125)
    neutral = {"k2": 0.0, "viscous_drag.coefficient": 0.0}
    again = plant.means([neutral, POINTS[1], POINTS[1]], [0], 4, 50)
    assert (plant.work.asked, plant.work.simulated) == (20, 8)
    for of, was in zip(again, [*first, first[1]], strict=True):
        np.testing.assert_array_equal(of[0], was[0])


@pytest.mark.parametrize("other", ["point", "cycle", "seed", "step", "command"])
def test_whatever_makes_another_run_is_simulated(shipped_plant, data, other):
    plant = EmaPlant(shipped_plant, data, 1)
    plant.means([{}], [0], 2, 50)
    if other == "command":
        plant.late = 1
    point, seed = ({"k1": 0.01} if other == "point" else {}), (52 if other == "seed" else 50)
    steps = (2e-6,) if other == "step" else STEPS
    plant.means([point], [1 if other == "cycle" else 0], 2, seed, steps)
    assert plant.work.simulated == 4


def test_noise_of_a_motion_does_not_depend_on_others(shipped_plant, data):
    motion = replace(data, commands=data.commands[:1], motion=np.zeros(1, int), labels=data.labels[:1])
    both, alone = (Noise(EmaPlant(shipped_plant, of, 1), {}, (16, 8)) for of in (data, motion))
    assert len(both.motions) == 2
    np.testing.assert_array_equal(both.motions[0].fresh, alone.motions[0].fresh)
    np.testing.assert_array_equal(both.motions[0].envelope_sd, alone.motions[0].envelope_sd)


def test_memory_keeps_no_more_than_it_may_and_forgets_the_longest_unused():
    memory = Memory(2)
    runs = [Asked(frozenset(), 0, seed, 1e-6, 0, None) for seed in range(3)]
    made = Runs(np.arange(3.0)[:, None], np.arange(3.0)[:, None])
    memory.keep(runs[:2], Runs(made.features[:2], made.envelopes[:2]))
    memory.recall([runs[0]])
    memory.keep(runs[2:], Runs(made.features[2:], made.envelopes[2:]))
    np.testing.assert_array_equal(memory.recall([runs[2], runs[0]]).features.ravel(), [2.0, 0.0])
    assert memory.unknown([*runs, runs[1]]) == [runs[1]]


def test_a_control_period_that_no_usual_step_divides_is_simulated(shipped_plant, hidden):
    """At 8 kHz 0.8 µs do not, and such records were refused."""
    rate = 8000.0
    plant = shipped_plant.model_copy(update={"control": shipped_plant.control.model_copy(update={"rate": rate})})
    (cycle,) = hidden.cycles(hidden.Flaws(), 1, 3, (hidden.chirp(duration=0.22),))
    slower = {**cycle, "t": np.arange(len(cycle["t"])) / rate}
    ema = EmaPlant(plant, prepare(plant, [Record((Cycle(0, slower),))]), 1)
    (mean,) = ema.means([{}], [0], 2, 50)
    assert np.isfinite(mean[0]).all()
    assert ema.work.steps == (len(cycle["t"]) - 1) * (125 + 156)
