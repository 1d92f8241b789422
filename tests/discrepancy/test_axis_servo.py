"""Speed loops that act faster than the record, and a motor that saturates (tests/support/servo.py)."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.between import Rereading, examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.fitting import fit
from ema.discrepancy.plant import Fitted
from ema.discrepancy.progress import Progress
from ema.discrepancy.selection import fit_base, fit_with_each
from ema.models.axis_config import RotaryAxis

ACTS_BETWEEN = "the speed loop acts between the samples of the record too"
COMMAND_TOO = "the speed loop and its command act between the samples of the record too"


@pytest.fixture(scope="module")
def servo(support) -> ModuleType:
    return support("servo")


def look(servo, plant, **hidden):
    return examine_ways(AxisPlant(RotaryAxis.model_validate(plant), [servo.record(1, **hidden)]))


@pytest.mark.parametrize("samples", [True, False])
def test_how_often_a_speed_loop_acts_is_no_heavier_axis(servo, samples):
    outcome = look(servo, servo.SPEED_LOOP, samples=samples)
    assert outcome.verdict == "adequate"
    assert outcome.effects == []
    assert (ACTS_BETWEEN in outcome.notes) == (not samples)


def test_a_command_that_runs_between_samples_is_no_heavier_axis(servo):
    outcome = look(servo, servo.SPEED_LOOP, straight=True)
    assert outcome.verdict == "adequate"
    assert outcome.effects == []
    assert COMMAND_TOO in outcome.notes


@pytest.mark.slow
@pytest.mark.parametrize("samples", [True, False])
def test_a_heavier_axis_is_named_and_its_interval_holds_the_truth(servo, samples):
    outcome = look(servo, servo.SPEED_LOOP, samples=samples, inertia=1.05 * 0.0085)
    assert [e["name"] for e in outcome.effects] == ["inertia"]
    change = outcome.effects[0]["parameters"]["change"]
    assert change["low"] - 1e-3 <= 0.05 <= change["high"] + 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("samples", [True, False])
def test_a_current_that_lags_in_a_speed_loop_is_named(servo, samples):
    outcome = look(servo, servo.SPEED_LOOP, samples=samples, lag=2e-3)
    (found,) = outcome.effects
    assert found["name"] == "drive_lag"
    assert found["parameters"]["time"]["value"] == pytest.approx(2e-3, rel=0.05)


@pytest.mark.slow
def test_a_motor_that_saturates_is_not_taken_for_a_drive_that_is_held(servo):
    outcome = look(servo, servo.CURRENT, position=True, i_sat=2.5, seconds=4.0)
    assert "saturation" in [e["name"] for e in outcome.effects]
    assert not any("between samples" in note for note in outcome.notes)


@pytest.mark.slow
def test_a_drive_with_a_clock_of_its_own_adds_up_to_a_delay(servo):
    (cycle,) = servo.record(1, position=True, seconds=6.0)
    t, i_q = cycle["t"], cycle["i_q"]
    record = Record((Cycle(0, {**cycle.channels, "i_q": np.interp(t * (1.0 + 5e-4), t, i_q)}),))
    outcome = examine_ways(AxisPlant(RotaryAxis.model_validate(servo.CURRENT), [record]))
    assert [e["name"] for e in outcome.effects] == ["clock_skew"]
    found = outcome.effects[0]["parameters"]["currents"]
    assert found["value"] == pytest.approx(5e-4, rel=0.03)


def test_an_inertia_of_half_a_thousandth_is_no_cause(servo):
    outcome = look(servo, servo.SPEED_LOOP, samples=True, inertia=1.0005 * 0.0085)
    assert outcome.verdict == "adequate"


def test_a_drive_that_is_held_is_taken_so_unless_an_effect_foretells_more(support):
    """Late by half a sample throughout, which a clock that is late by one at the end comes near to."""
    geared = support("geared")
    axis = geared.Axis(by_square=1.9)
    plant = AxisPlant(RotaryAxis.model_validate(geared.plant(axis)), [geared.record(axis, 1, seconds=5.0)])
    plain = fit_base(plant)

    def only(*names):
        return lambda point, blocks: [c for c in plant.candidates(point, blocks) if c.key in names]

    trials = fit_with_each(plant, plain, only("saturation", "clock_skew of the drive"), str)
    reread = Rereading(plant, Progress())
    assert not reread(plain, trials["saturation"])
    assert plant.between == "straight"
    beside = fit_with_each(plant, trials["saturation"], only("clock_skew of the drive"), str)
    assert reread(trials["saturation"], beside["clock_skew of the drive"])
    assert plant.between == "held"


def test_what_noise_makes_of_parameters_is_no_error_of_the_simulation(servo):
    """The floor rises by the mean square of what drawn parameters do to a free run."""
    plant = AxisPlant(RotaryAxis.model_validate(servo.CURRENT), [servo.record(1, position=True, seconds=3.0)])
    blocks = range(len(plant.blocks))
    F_d = fit(plant, plant.base, {f.name: f.start for f in plant.base}, blocks)
    wide = Fitted(F_d.free, 100.0 * F_d.by_noise)
    sharp, loose = (plant.errors(F_d.point, blocks, of) for of in (None, wide))
    sd = np.sqrt(np.diag(wide.covariance))
    moved = [plant.errors({**F_d.point, F_d.free[0].name: F_d.point[F_d.free[0].name] + s * sd[0]}, blocks).error ** 2
             for s in (-1.0, 1.0)]  # fmt: skip
    assert len(F_d.free) == 1
    assert loose.error == sharp.error
    assert loose.noise_floor**2 - sharp.noise_floor**2 == pytest.approx(np.mean(moved) - sharp.error**2, rel=0.05)
