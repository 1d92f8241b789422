"""A recorder that filters the current, of a simulation of others: named with its time constant, no gear that creeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Record
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

TIME, NOISE = 4e-3, 5e-3  # [s], [A]


def filtered(record: Record) -> Record:
    """As if a filter of the first order stood before the recorder; the drive is held between samples."""
    (cycle,) = record.cycles
    i, fades = cycle["i_q"], np.exp(-cycle.period / TIME)
    x, out = i[0], []
    for value in i:
        out.append(x)
        x = value + fades * (x - value)
    noise = NOISE * np.random.default_rng(1).standard_normal(len(i))
    return replace(record, cycles=(replace(cycle, channels={**cycle.channels, "i_q": np.array(out) + noise}),))


@pytest.mark.slow
def test_a_filter_of_the_recorder_is_named_with_its_time_constant(support):
    strange = support("strange")
    bench = strange.Axis()
    record = filtered(strange.record("nothing", bench, 3))
    outcome = examine_ways(AxisPlant(RotaryAxis.model_validate(strange.plant(bench)), [record], n_threads=1))
    (found,) = outcome.effects
    assert found["name"] == "drive_filter"
    assert found["confidence"] > 0.9
    assert found["parameters"]["time"]["value"] == pytest.approx(TIME, rel=0.05)
