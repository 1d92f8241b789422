"""A gear that gives, seen in a user that is read late or held by a spring: neither is drag or stiffness.

The records are of the tests' own simulation, which shares no code with the library.
"""

from __future__ import annotations

import hidden_actuator as hidden
import numpy as np
import pytest

from ema.core import config, resources
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import begin
from ema.discrepancy.actuator.finding.forward import fit_with_one_more
from ema.discrepancy.actuator.finding.screening import rank_to_first_order
from ema.discrepancy.actuator.fitting.search import start_model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.gear import find_resonance
from ema.discrepancy.progress import Progress
from ema.models.actuator import Actuator

COMPLIANCE, INERTIA, DAMPER = 3e-5, 0.6, 30.0
RATIO = DAMPER * 0.5 * np.sqrt(COMPLIANCE / INERTIA)


def find(seed, motions, **flaws):
    """The resonance seen in three cycles."""
    plant, data = measure(seed, motions, **flaws)
    found = find_resonance(plant, data)
    assert found is not None
    return found


def measure(seed, motions, **flaws):
    """The shipped plant, and three cycles of a bench with flaws."""
    made = hidden.cycles(
        hidden.Flaws(user_inertia=INERTIA, user_damping=DAMPER, **flaws), 3, seed, motions, hidden.Bench()
    )
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    return plant, prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(made)))])


@pytest.mark.parametrize("late", [0.0, 7e-4])
def test_its_resonance_is_found_as_it_is_however_late_it_is_read(late):
    found = find(5, hidden.MOTIONS, compliance=COMPLIANCE, recorder_delay=late)
    assert found.compliance * found.inertia == pytest.approx(COMPLIANCE * INERTIA, rel=0.02)
    assert found.damping == pytest.approx(RATIO, rel=0.1)
    assert found.drag < 1.0  # [N m s/rad]; half of the damper's, or more, where the delay was taken for it
    assert found.friction < 0.1  # [N m]
    assert found.spring == 0.0


@pytest.mark.parametrize("beside", [{}, {"user_drag": 10.0}, {"k2": 0.05}])
def test_its_resonance_is_found_though_a_spring_holds_the_user(beside):
    """A spring twists the gear more than it rings: without one in mind no resonance was seen."""
    spring = 4000.0 if beside.get("k2") else 1500.0
    found = find(2, (hidden.chirp(),), compliance=1.5e-5, spring=spring, **beside)
    assert found.compliance * found.inertia == pytest.approx(1.5e-5 * INERTIA, rel=0.02)
    assert found.inertia == pytest.approx(INERTIA, rel=0.05)
    assert found.spring == pytest.approx(spring, rel=0.05)
    assert found.drag == pytest.approx(beside.get("user_drag", 0.0), abs=1.0)
    assert found.k2 == pytest.approx(beside.get("k2", 0.0), abs=0.003)


@pytest.mark.further
def test_a_spring_seen_with_the_gear_is_fitted_with_it():
    """One at a time neither was kept: the gear alone left more than nothing did."""
    plant, data = measure(3, hidden.MOTIONS, compliance=3e-5, spring=2500.0, k4=0.03)
    search, _ = begin(plant, data, 1, Progress(), {})
    alone = start_model(search, {})
    best = fit_with_one_more(search, alone, rank_to_first_order(search, alone))[0]
    assert set(best.names) == {"gear_compliance", "spring_load"}
    assert best.excess < 0.1 * alone.excess
    point = best.fit.point
    assert point["spring_load.stiffness"] == pytest.approx(2500.0, rel=0.05)
    assert point["gear_compliance.compliance"] * point["gear_compliance.inertia"] == pytest.approx(
        COMPLIANCE * INERTIA, rel=0.05
    )
