"""A coupling that slips once: no law of the library does that, and the record is not adequate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.mark.slow
@pytest.mark.parametrize("slip", [0.0, 0.09])
def test_a_slip_is_told_with_its_time_and_no_record_without_one(axis_other, slip):
    setup = replace(axis_other.BASE, speed="none", duration=6.0, motions=((25.0, 0.9, 0.0),))
    (cycle,) = axis_other.record(setup, 4)
    slipped = cycle["theta_m"] - np.interp(cycle["t"], [3.70, 3.71], [0.0, slip])
    record = Record((Cycle(0, {**cycle.channels, "theta_m": slipped}),))
    plant = AxisPlant(RotaryAxis.model_validate(axis_other.plant(setup)), [record])
    found = findings(plant, examine_ways(plant))
    assert found.effects == []
    if not slip:
        assert found.verdict == "adequate"
        assert "something happened" not in " ".join(found.sentences())
        return
    assert found.verdict == "unexplained"
    told = found.structure["event"]
    begin, end = (float(x) for x in told.split("(")[1].split(" s)")[0].split(" to "))
    assert begin < 3.71
    assert end > 3.70
    assert end - begin < 1.0
