"""An angle that errs once per turn gives a line of cogging two smaller ones beside it, which the motor has not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

pytestmark = pytest.mark.slow
COGGING, ORDER = 8e-3, 24.0  # [N m], 1/turn
ERROR, PHASE = 0.006, 0.7  # [rad]


def wrong(cycle, error, beside):
    """The same by an encoder that errs, and with a current that holds against another line, as if the drive gave it."""
    theta = cycle["theta_m"]
    i_q = cycle["i_q"] + beside * np.sin((ORDER + 1.0) * theta + 0.3)
    return Cycle(cycle.number, {**cycle.channels, "theta_m": theta + error * np.cos(theta + PHASE), "i_q": i_q})


@pytest.fixture(scope="module")
def examined(support):
    other = support("axis_other")

    def run(error, beside, seed):
        """Cogging, with an encoder that errs or with a weaker line `beside` it, one above."""
        hidden = [0.0] * 8
        hidden[other.COGGING], hidden[other.ORDER] = COGGING, ORDER
        setup = replace(
            other.SETUPS["clean"],
            noise={"position": 2e-6, "speed": 0.05, "drive": 0.005, "u": 0.02, "i": 5e-3},
            channels=("i_q", "theta_m"),
            duration=2.0,
            hidden=tuple(hidden),
        )
        made = [wrong(cycle, error, beside / setup.k_t) for cycle in other.record(setup, seed).cycles]
        return examine_ways(
            AxisPlant(RotaryAxis.model_validate(other.plant(setup)), [Record(tuple(made))], n_threads=1)
        )

    return run


def orders(outcome):
    return sorted(e["parameters"]["order"]["value"] for e in outcome.effects if e["name"] == "cogging")


def test_an_angle_that_errs_is_named_and_no_line_beside_the_one_that_is_there(examined):
    outcome = examined(ERROR, 0.0, 1)
    assert orders(outcome) == [ORDER]
    (error,) = [e["parameters"] for e in outcome.effects if e["name"] == "resolver_error"]
    for name, truth in (("once_cosine", ERROR * np.cos(PHASE)), ("once_sine", -ERROR * np.sin(PHASE))):
        assert error[name]["value"] == pytest.approx(truth, abs=0.1 * ERROR)


@pytest.mark.further
def test_a_line_beside_another_that_is_there_is_named(examined):
    outcome = examined(0.0, 0.25 * COGGING, 2)
    assert orders(outcome) == [ORDER, ORDER + 1.0]
    assert "resolver_error" not in {e["name"] for e in outcome.effects}
