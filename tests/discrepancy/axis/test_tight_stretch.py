"""A guide that is tight from here to there, with sharp ends: no bump, and wide."""

from __future__ import annotations

from types import ModuleType

import pytest

from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import LinearAxis


@pytest.fixture(scope="module")
def positioner(support) -> ModuleType:
    return support("positioner")


STRETCHES = [
    pytest.param(0.03, 0.14, 14.0, marks=pytest.mark.further),
    pytest.param(0.06, 0.13, 14.0, marks=pytest.mark.further),
    (0.05, 0.13, -9.0),
]


@pytest.mark.parametrize(("low", "high", "more"), STRETCHES)
def test_where_a_guide_is_tight_and_by_how_much(positioner, low, high, more):
    bench = positioner.Table(tight=(low, high, more))
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [positioner.table(bench, 3)])
    found = findings(plant, examine_ways(plant))
    (e,) = found.effects
    assert e.name == "position_friction"
    half = 0.5 * (high - low)
    assert e.parameters["centre"].value == pytest.approx(0.5 * (low + high), abs=0.1 * half)
    assert e.parameters["width"].value == pytest.approx(half, rel=0.1)
    assert e.parameters["height"].value * found.fitted["F_d"] == pytest.approx(more, rel=0.1)
    assert e.parameters["flatness"].value > 0.5
    assert found.fitted["F_d"] == pytest.approx(bench.F_d, rel=0.05)
