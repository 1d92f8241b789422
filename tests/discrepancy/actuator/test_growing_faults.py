"""Faults that grow while a record is made, and what only looks like it: motions that ask for other faults.

The records are of the tests' own simulation, which shares no code with the library.
"""

from __future__ import annotations

import hidden_actuator as hidden
import numpy as np
import pytest
from trials import prepare_drawn

from ema.core import config, resources
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import begin
from ema.discrepancy.actuator.fitting.growing import TOLD, find_growing_faults
from ema.discrepancy.actuator.fitting.search import start_model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.progress import Progress
from ema.models.actuator import Actuator


def find(plant, data):
    """Faults of each cycle where these grow, by the noise of faults alone."""
    search, _ = begin(plant, data, 1, Progress(), {})
    alone = start_model(search, {})
    search.noise = Noise(search.plant, alone.fit.point)
    return find_growing_faults(search, alone)


@pytest.mark.further
def test_motions_that_ask_for_other_faults_are_no_growth():
    """A heavier rotor and gains of sensors: far from the data, noise seems less than it is and cycles to differ."""
    trial, data = prepare_drawn("two effects", 1, 197904309)
    assert find(trial.actuator, data) is None


@pytest.mark.further
def test_a_short_that_grows_is_told_in_every_cycle():
    made = [
        hidden.cycles(hidden.Flaws(k3=k3), 1, 50 + n, hidden.MOTIONS[n % 2 :], hidden.Bench())[0]
        for n, k3 in enumerate(np.linspace(0.02, 0.08, 6))
    ]
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    found = find(plant, prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(made)))]))
    assert found is not None
    assert np.ptp(found[::2, 2]) > TOLD
    assert found[:, 2] == pytest.approx(np.linspace(0.02, 0.08, 6), abs=0.01)
