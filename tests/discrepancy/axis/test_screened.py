"""What the balance of torque shows is tried in free runs, and what it cannot tell from that too."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ema.discrepancy.axis.finding.screened import begin_at, suggest_by_balance

MOTOR, LOAD = "quadratic_load_friction", "quadratic_output_load_friction"


@pytest.fixture(scope="module")
def plant(support):
    """Eight seconds, in which friction by the square of the motor's torque is not told from that by the load's too."""
    geared = support("geared")
    return geared.held(geared.Axis(by_square=2.5))


def tried(plant, balance, point=()):
    return {c.key: c for c in suggest_by_balance(balance, plant.plant, dict(point))}


def test_a_law_that_the_balance_cannot_tell_from_its_own_is_tried_too(plant):
    (term,) = plant.balance.terms
    assert {term.law.name, *term.alike} == {MOTOR, LOAD}
    assert set(tried(plant, plant.balance)) == {MOTOR, LOAD}
    sure = replace(plant.balance, terms=(replace(term, alike={}, instead=()),))
    assert set(tried(plant, sure)) == {term.law.name}


def test_it_is_begun_where_it_was_fitted_itself(plant):
    (start,) = tried(plant, plant.balance)[MOTOR].starts
    assert start[f"{MOTOR}.per_square"] * plant.plant.F_d == pytest.approx(2.5, rel=0.1)


def test_what_a_model_has_is_not_tried_again(plant):
    assert set(tried(plant, plant.balance, {f"{MOTOR}.per_square": 1.0})) == {LOAD}


def test_what_a_law_has_at_zero_is_held():
    """An exponential fall of friction has the shape 0: a fit that may move it by nothing has no slope there."""
    law = begin_at("stribeck", {"excess": 0.4, "speed": 2.4, "shape": 0.0}, {}, 6.0)
    assert {f.name for f in law.free} == {"stribeck.excess", "stribeck.speed"}
    assert law.starts[0]["stribeck.shape"] == 0.0


def test_a_law_of_one_number_leaves_that_to_the_fit():
    """A real servo's balance held quadratic drag beside its free runs, and nothing of it was free: a traceback."""
    law = begin_at("quadratic_drag", {"coefficient": 2e-4}, {}, 6.0)
    assert [f.name for f in law.free] == ["quadratic_drag.coefficient"]


def test_what_the_balance_shows_by_one_way_of_the_drive_is_tried_by_another_too(plant):
    """A held drive bent it, and a motor that saturates was alone with what friction by its torque squared does."""
    shown = plant.balance
    assert plant.between == "held"
    plant._balances["straight"] = replace(shown, terms=())
    way, plant.between = plant.between, "straight"
    point = {f.name: f.start for f in plant.base}
    try:
        assert plant.balance.terms == ()
        assert {MOTOR, LOAD} <= {c.key for c in plant.candidates(point, range(len(plant.blocks)))}
    finally:
        plant.between = way
        del plant._balances["straight"]
