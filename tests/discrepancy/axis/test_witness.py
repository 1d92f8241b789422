"""A law that the balance adds is as sure as free runs that follow the motion need it too."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.judging import witness
from ema.discrepancy.axis.judging.agreeing import merge


@pytest.fixture(scope="module")
def plant(support):
    geared = support("geared")
    return geared.held(geared.Axis(dry_slope=0.04))


def plain(plant):
    return {f.name: f.start for f in plant.base}


def names(answer):
    return [e.name for e in answer[0]]


def test_a_law_that_is_there_takes_from_free_runs_what_it_takes_from_the_balance(plant):
    (term,) = plant.balance.terms
    assert term.law.name == "friction_slope"
    assert witness.measure_support(plant, plain(plant), plant.balance, [term])[0] > 0.9
    assert "friction_slope" in names(merge(plant, [], "unexplained", plain(plant), follows=True))


def test_a_law_that_does_nothing_in_free_runs_is_not_added(plant, monkeypatch):
    """Friction by a load that the model has not."""
    monkeypatch.setattr(witness, "effects", lambda *_: {"output_load_friction": {"share": 0.1}})
    (term,) = plant.balance.terms
    assert witness.measure_support(plant, plain(plant), plant.balance, [term])[0] < 0.1
    assert names(merge(plant, [], "unexplained", plain(plant), follows=True)) == []
    assert names(merge(plant, [], "unexplained", plain(plant))) == ["friction_slope"]
