"""A linear motor's magnets: forces that repeat along the travel, of no whole number of periods."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import yaml

from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.named_laws import name_laws
from ema.discrepancy.extended import write_extended
from ema.effects import registry
from ema.models import axis_config
from ema.models.axis_config import LinearAxis

MAGNETS = ((8.0, 0.0241, 0.4), (3.0, 0.01205, 2.0))  # N, m, rad


@pytest.fixture(scope="module")
def positioner(support) -> ModuleType:
    return support("positioner")


def examined(positioner, bench, seed):
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [positioner.table(bench, seed)])
    return findings(plant, examine_ways(plant))


def test_the_magnets_of_a_linear_motor_are_named_with_their_pitch(positioner, tmp_path):
    bench = positioner.Table(magnets=MAGNETS)
    found = examined(positioner, bench, 5)
    assert [e.name for e in found.effects] == ["position_line"] * 2
    assert min(e.confidence for e in found.effects) > 0.9
    for e, (A, period, _) in zip(
        sorted(found.effects, key=lambda e: -e.parameters["amplitude"].value), MAGNETS, strict=True
    ):
        for name, truth, unit in (("amplitude", A, "N"), ("order", 2.0 * np.pi / period, "rad/m")):
            q = e.parameters[name]
            assert q.unit == unit
            assert q.value == pytest.approx(truth, rel=0.03)
            assert q.low <= truth <= q.high
    plant_file, out = tmp_path / "axis.yaml", tmp_path / "extended.yaml"
    plant_file.write_text(yaml.safe_dump(positioner.table_plant(bench)), encoding="utf-8")
    write_extended(plant_file, found.effects, out)
    assert set(axis_config.load(out).effects) == {"position_line", "position_line#2"}


def test_a_pitch_by_the_balance_alone_has_an_interval_and_is_no_step_of_a_grid(positioner):
    """A line stands for those between it and the next: its order had been a multiple of a step, surely."""
    bench = positioner.Table(magnets=MAGNETS[:1])
    plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(bench)), [positioner.table(bench, 11)])
    b = plant.balance
    assert b is not None
    lines = [e for e in name_laws(plant, b, b.terms) if e.name == "position_line"]
    q = max(lines, key=lambda e: e.parameters["amplitude"].value).parameters["order"]
    assert q.low < q.value < q.high
    assert q.value == pytest.approx(2.0 * np.pi / MAGNETS[0][1], rel=0.003)


def test_a_table_without_magnets_has_no_line_along_its_travel(positioner):
    assert "position_line" not in {e.name for e in examined(positioner, positioner.Table(), 6).effects}


def test_its_sentence_tells_the_period():
    assert "once in 0.024 m" in registry()["position_line"].said({"amplitude": 8.0, "order": 2.0 * np.pi / 0.024})
