"""A torque from outside the motor beside its cogging: named where records tell, a set where they do not."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.external import add_external
from ema.discrepancy.extended import write_extended
from ema.discrepancy.findings import FoundEffect, Quantity
from ema.models.axis_config import RotaryAxis

OWN = (0.006, 12.0, 0.7)
NEIGHBOUR, TURNED = (0.004, 9.0, 0.3), (0.004, 9.0, 0.3 + np.pi)


@pytest.fixture(scope="module")
def bench(support):
    geared = support("geared")

    def of(*lines, **more):
        records = [geared.record(geared.Axis(lines=own), seed, seconds=6.0) for seed, own in enumerate(lines, 1)]
        plant = AxisPlant(RotaryAxis.model_validate(geared.plant(geared.Axis(), **more)), records)
        plant.between = "held"
        return plant

    return of


def cogging(order, confidence=0.99):
    """As free runs name it."""
    values = {"amplitude": (0.006, "N m"), "order": (order, "1/turn"), "phase": (0.7, "rad")}
    parameters = {name: Quantity(x, x, x, unit) for name, (x, unit) in values.items()}
    return FoundEffect("cogging", confidence, (), parameters, "cogging torque", "slow motion")


def test_records_that_agree_name_no_neighbour(bench):
    assert add_external(bench((OWN,), (OWN,)), []) == []


def test_a_torque_that_turns_round_between_records_is_a_neighbour_s_or_another_zero(bench):
    plant = bench((OWN, NEIGHBOUR), (OWN, TURNED))
    (e,) = add_external(plant, [cogging(9.0)])
    assert plant.zeros["record 2"].angle == 0.0
    assert (e.name, e.indistinguishable_from) == ("external_torque", ("another_zero",))
    assert e.parameters["order"].value == 9.0
    assert e.parameters["amplitude"].value == pytest.approx(0.008, rel=0.03)  # from one record to the other
    assert "record 1" in e.sentence
    assert "turns round" in e.sentence


def test_a_torque_that_only_one_of_three_records_has_is_named_with_that_record(bench):
    (e,) = add_external(bench((OWN,), (OWN, (0.004, 12.0, 0.3)), (OWN,)), [])
    assert (e.name, e.indistinguishable_from) == ("external_torque", ())
    assert e.confidence > 0.9
    assert "acts in record 2 and in no other" in e.sentence
    assert e.parameters["amplitude"].low < 0.004 < e.parameters["amplitude"].high
    assert e.parameters["phase"].low < 0.3 < e.parameters["phase"].high


@pytest.mark.parametrize(
    ("declared", "order", "others", "confidence"),
    [
        ({}, 12.0, ("external_torque",), 0.94),
        ({"p": 2, "slots": 6}, 12.0, (), 0.99),
        ({"p": 2, "slots": 6}, 9.0, ("external_torque",), 0.495),
    ],
)
def test_one_record_tells_a_neighbour_by_the_motor_s_own_orders_only(bench, declared, order, others, confidence):
    (e,) = add_external(bench((OWN,), **declared), [cogging(order)])
    assert (e.name, e.indistinguishable_from) == ("cogging", others)
    assert e.confidence == pytest.approx(confidence, abs=0.01)


def test_a_set_with_a_neighbour_is_no_surer_than_the_line(bench):
    (e,) = add_external(bench((OWN,)), [cogging(12.0, 0.63)])
    assert e.of_set == pytest.approx(0.63, abs=1e-3)


def test_what_acts_in_some_records_is_said_in_the_extended_model_and_acts_in_none(bench, tmp_path):
    (e,) = add_external(bench((OWN,), (OWN, NEIGHBOUR)), [])
    plant = tmp_path / "plant.yaml"
    plant.write_text("kind: axis\nJ: 1e-4\nF_d: 0.02\nk_t: 0.05\n")
    write_extended(plant, [e], tmp_path / "extended.yaml")
    text = (tmp_path / "extended.yaml").read_text()
    assert "not in every record" in text
    assert "external_torque" not in (yaml.safe_load(text).get("effects") or {})
