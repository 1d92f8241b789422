"""What an angle makes of inertia and friction: a crank, and a shaft that rubs twice per turn, by another simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.sizes import sizes
from ema.discrepancy.axis.scanning.rubbing import rubbing_candidate
from ema.effects import registry
from ema.models.axis_config import RotaryAxis

RUBS, PHASE = 0.4, 0.7  # of dry friction, twice per turn


def rubs(t, theta, w):
    """F_2 cos(2θ + φ) against the motion"""
    return RUBS * on_paper.F_D * np.cos(2.0 * theta + PHASE) * np.sign(w)


def test_the_balance_tells_friction_twice_per_turn_and_no_ripple_of_the_motor():
    """Where friction is most of what the motor gives, a torque constant that ripples takes most of it."""
    (term,) = describe(on_paper.plant(on_paper.cycle(rubs)).balance, linear=False)["terms"]
    assert term["name"] == "friction_by_angle"
    found = {name: q["value"] / on_paper.F_D for name, q in term["parameters"].items()}
    assert found["twice_cosine"] == pytest.approx(RUBS * np.cos(PHASE), abs=0.02)
    assert found["twice_sine"] == pytest.approx(-RUBS * np.sin(PHASE), abs=0.02)


def test_a_fit_of_friction_that_changes_over_a_turn_begins_near_it():
    plant = on_paper.plant(on_paper.cycle(rubs), F_d=0.8 * on_paper.F_D)
    at, every = {"F_d": 0.8 * on_paper.F_D}, on_paper.everywhere(plant)
    found = rubbing_candidate(plant, sizes(plant), at, every)
    (start,) = found.starts
    assert start["F_d"] == pytest.approx(on_paper.F_D, rel=0.05)
    assert start["friction_by_angle.twice_cosine"] == pytest.approx(RUBS * np.cos(PHASE), abs=0.05)
    assert start["friction_by_angle.twice_sine"] == pytest.approx(-RUBS * np.sin(PHASE), abs=0.05)
    assert rubbing_candidate(plant, sizes(plant), start, every) is None
    swings = replace(sizes(plant), half_range=0.5)
    assert rubbing_candidate(plant, swings, at, every) is None
    assert registry()["inertia_by_angle"].on_axis(swings) is None


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.further)])
def test_a_crank_is_named_by_free_runs_and_no_resolver(support, seed):
    """A speed that ripples in proportion to itself: a resolver that errs twice per turn takes most of it."""
    strange = support("strange")
    axis = strange.Axis()
    record = strange.record("crank", axis, seed, seconds=5.0)
    outcome = examine_ways(AxisPlant(RotaryAxis.model_validate(strange.plant(axis)), [record], n_threads=1))
    (effect,) = [e for e in outcome.effects if e["confidence"] > 0.9]
    assert effect["name"] == "inertia_by_angle"
    assert "resolver_error" not in {e["name"] for e in outcome.effects}
    _, (amplitude, _, phase) = strange.draw(strange.CRANK, axis, np.random.default_rng(seed))
    for part, truth in (("twice_cosine", np.cos(phase)), ("twice_sine", -np.sin(phase))):
        assert effect["parameters"][part]["value"] == pytest.approx(amplitude * truth, abs=0.03)
