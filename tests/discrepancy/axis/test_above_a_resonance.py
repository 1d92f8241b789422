"""Test functions between a resonance and its double all show the inertia of one side of it: wider ones tell."""

from __future__ import annotations

from pathlib import Path

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def found(support):
    servo = support("swinging_servo")
    file = {"J": 0.01, "F_d": 0.001, "k_t": servo.K_T, "k_e": servo.K_T, "R": servo.R, "L": 0.0}
    own = RotaryAxis.model_validate({**file, "drive": "voltage", "measured_at": "load"})
    plant = AxisPlant(own, [Record((Cycle(0, servo.simulate(16.0)),), source=Path("servo.csv"))], n_threads=1)
    plant.between = "held"
    return servo, plant.balance


def test_the_whole_inertia_is_found_and_not_that_of_the_arm(found):
    servo, balance = found
    assert balance.model.base[0] == "inertia"
    assert balance.corrected.coefficients[0] == pytest.approx(servo.J_M + servo.J_L, rel=0.05)


def test_what_hangs_on_the_arm_is_found(found):
    servo, balance = found
    assert [term.law.name for term in balance.terms] == ["pendulum"]
    (term,) = balance.terms
    values = term.law.values(balance.corrected.coefficients[balance.model.part(term.law)])
    assert values["amplitude"] == pytest.approx(servo.GRAVITY, rel=0.05)
    assert balance.confidence(term) > 0.9
