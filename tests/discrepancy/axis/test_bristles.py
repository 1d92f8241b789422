"""Friction that builds up over a way far shorter than the travel: seen by free runs, not by the balance of torque.

The records are of the tests' own simulation of bristles (`tests/support/bristled.py`).
"""

from __future__ import annotations

import bristled
import pytest

from ema.discrepancy.axis.finding import candidates
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.fitting import fit
from ema.models.axis_config import RotaryAxis

SIZE = {"friction_memory.deflection": bristled.WAY}


def plant_of(**bench) -> AxisPlant:
    build = {"kind": "axis", **bristled.PLANT}
    plant = AxisPlant(RotaryAxis.model_validate(build), [bristled.record(3, rate=2000.0, seconds=2.0, **bench)])
    plant.between = "held"  # as this bench's drive is
    return plant


def nominal(plant):
    return {f.name: f.start for f in plant.base}


def costs(plant, *points):
    return [sum(float((r**2).sum()) for r in of) for of in plant.residuals(points, range(len(plant.blocks)))]


def test_a_search_of_the_library_begins_near_enough_to_find_the_way_and_the_damping():
    plant = plant_of(load=0.0)
    every = range(len(plant.blocks))
    (memory,) = (c for c in candidates.library(plant, nominal(plant), every) if c.effect == "friction_memory")
    tried = [fit(plant, [*plant.base, *memory.free], {**nominal(plant), **s}, every) for s in memory.starts]
    best = min(tried, key=lambda fitted: sum(float((r**2).sum()) for r in fitted.residuals))
    assert best.point["friction_memory.deflection"] == pytest.approx(bristled.WAY, rel=0.04)
    ratio = 0.5 * bristled.S_1 * (bristled.F_C * bristled.J / bristled.WAY) ** -0.5
    assert best.point["friction_memory.damping"] == pytest.approx(ratio, rel=0.15)


def test_friction_of_next_to_no_way_needs_no_memory():
    plant = plant_of(load=0.0, way=bristled.WAY * 0.05)
    without, with_memory = costs(plant, nominal(plant), nominal(plant) | SIZE)
    assert without < with_memory


def test_bristles_and_a_constant_load_are_not_friction_that_knows_directions():
    plant = plant_of(load=0.02)
    at = nominal(plant) | SIZE
    load, asymmetric = costs(
        plant, at | {"constant_load.torque": 0.02}, at | {"asymmetric_friction.asymmetry": 0.02 / bristled.F_C}
    )
    assert load < 0.5 * asymmetric


def test_friction_by_the_load_takes_not_the_place_of_all_that_the_drive_is_needed_for():
    """With a share above one it explains what drives by itself, and leaves a negative inertia."""
    plant = plant_of(load=0.0)
    plant.between = "straight"
    b = plant.balance
    assert [term.law.name for term in b.terms] == []
    assert b.corrected.coefficients[b.model.base.index("inertia")] == pytest.approx(bristled.J, rel=0.02)
