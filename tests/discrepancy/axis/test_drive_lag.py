"""A current loop of finite bandwidth, from simulations of others: named with its time constant, no late sensor."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


def effects_of(plant_file, record):
    return {e["name"]: e for e in examine_ways(AxisPlant(RotaryAxis.model_validate(plant_file), [record])).effects}


@pytest.mark.slow
def test_a_current_that_lags_is_named_alone_with_its_time_constant(support):
    strange = support("strange")
    bench = strange.Axis()
    found = effects_of(strange.plant(bench), strange.record("current_lag", bench, 3))
    rng = np.random.default_rng(3)
    rng.uniform(0.0, 6.0, 3)  # phases of the motion
    lag, *_ = strange.sizes(strange.LAG, bench, rng)
    assert set(found) == {"drive_lag"}
    assert found["drive_lag"]["confidence"] > 0.9
    assert found["drive_lag"]["parameters"]["time"]["value"] == pytest.approx(lag, rel=0.02)


@pytest.mark.slow
def test_a_late_speed_is_no_lag_of_the_current(axis_bench, hidden_axis):
    bench, _, rng = hidden_axis.bench_with(["speed_delay"], 5)
    found = effects_of(axis_bench.PLANT, axis_bench.record(bench, rng))
    assert "speed_delay" in found
    assert "drive_lag" not in {name for e in found.values() for name in (e["name"], *e["indistinguishable_from"])}
