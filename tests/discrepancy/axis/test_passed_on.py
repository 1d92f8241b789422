"""A gear that loses a share of what it passes on, to a load that hangs and is heavy: named, and what is behind it."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.mark.slow
def test_what_a_gear_loses_is_of_the_load_and_of_the_inertia_behind_it(support):
    geared = support("geared")
    axis = geared.Axis(gravity=0.15, by_load=0.2, passed_on=0.8, J=4e-4)
    plant = AxisPlant(RotaryAxis.model_validate(geared.plant(axis)), [geared.record(axis, 1, size=2.0)], n_threads=1)
    found = findings(plant, examine_ways(plant))
    named = {e.name: e for e in found.effects}
    lost = named.pop("output_load_friction")
    (hangs,) = named.values()
    assert "pendulum" in {hangs.name, *hangs.indistinguishable_from}  # or another torque once per turn: the same law
    assert lost.confidence > 0.9
    told = lost.parameters
    for name, true in (("share", 0.2), ("of_inertia", 0.8)):
        assert told[name].low <= true <= told[name].high
        assert told[name].value == pytest.approx(true, rel=0.1)
