"""A law that the balance adds is as sure as free runs that follow the motion need it too."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.judging import agreeing, witness
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


def test_a_law_that_free_runs_need_in_part_is_as_sure_as_that_with_the_same_interval(plant, monkeypatch):
    def merged(share):
        monkeypatch.setattr(agreeing, "measure_support", lambda *_: [share])
        ((found,), _) = merge(plant, [], "unexplained", plain(plant), follows=True)
        return found

    whole, part = merged(1.0), merged(0.97)
    assert part.confidence == pytest.approx(0.97 * whole.confidence, abs=1e-3)
    assert part.parameters == whole.parameters
