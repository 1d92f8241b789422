"""A driver that loses torque with one polarity: that is told, with each polarity's loss, and nothing beside it."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_driver_that_loses_positive_current_only_is_told_with_no_loss_of_the_other(axis_bench, hidden_axis, seed):
    """A mean loss beside a difference was an inertia, drag or friction by the load before each polarity had its own."""
    bench, plant_file, motions = hidden_axis.drawn(seed)
    bench, truth, rng = hidden_axis.bench_with(["one_sided_driver"], seed, bench)
    record = axis_bench.record(bench, rng, motions=motions)
    plant = AxisPlant(RotaryAxis.model_validate(plant_file), [record])
    found = findings(plant, examine_ways(plant)).as_dict()["effects"]
    assert "drive_unequal" in {effect["name"] for effect in found}
    assert {effect["name"] for effect in found} <= {"drive_unequal", "dry_friction"}  # the file has another friction
    lost = next(effect for effect in found if effect["name"] == "drive_unequal")["parameters"]
    for polarity, true in (("positive", truth["one_sided_driver"]["gain"] * plant_file["k_t"]), ("negative", 0.0)):
        sd = (lost[polarity]["high"] - lost[polarity]["low"]) / (2 * 1.96)
        assert lost[polarity]["value"] == pytest.approx(true, abs=max(3.0 * sd, 2e-3 * plant_file["k_t"]))
