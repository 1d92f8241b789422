"""Effects that a test of all that is left passes over: which are told, and when nothing is."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.actuator.fitting.model import Model
from ema.discrepancy.actuator.scoring import faint
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.engine.posterior import Entry


def model(*names):
    return SimpleNamespace(names=names)


def weighed(beside=(), **p):
    """Posterior of sets by what is in them beside the effects given, `nothing` for these alone; a model of each."""
    names = {name: beside if name == "nothing" else (*beside, name) for name in p}
    outcome = Outcome([Entry(names[name], x, 0.0, 0.0) for name, x in p.items()], [])
    return outcome, [model(*of) for of in names.values()]


@pytest.fixture(autouse=True)
def credible(monkeypatch):
    monkeypatch.setattr(faint, "is_credible", lambda model: "incredible" not in model.names)


@pytest.mark.parametrize("found", [(), ("supply_sag",), ("supply_sag", "stribeck")])
def test_what_is_sure_is_told_with_all_that_it_may_be(found):
    """Beside nothing, or beside what was found."""
    sets = weighed(found, clock_skew=0.7, inertia=0.26, cogging=0.03, nothing=0.01)
    heard, others = faint.hear(*sets, model(*found))
    assert heard.names == (*found, "clock_skew")
    assert others == ("inertia",)


def test_nothing_is_told_where_what_was_found_may_do_or_what_leads_is_no_cause():
    for found in ((), ("supply_sag",)):
        of = model(*found)
        assert faint.hear(*weighed(found, nothing=0.999, cogging=0.001), of) is None
        assert faint.hear(*weighed(found, incredible=0.99, nothing=0.01), of) is None
        assert faint.hear(*weighed(found, nothing=1.0), of) is None


def test_that_anything_is_missing_must_be_sure_and_a_further_cause_likely():
    """Beside gains of sensors and of the recorder, late comparators had 0.84 and were not told."""
    likely = {"comparator_delay": 0.84, "nothing": 0.16}
    assert faint.hear(*weighed((), **likely), model()) is None
    heard, _ = faint.hear(*weighed(("current_gain",), **likely), model("current_gain"))
    assert heard.names == ("current_gain", "comparator_delay")
    unlikely = {"comparator_delay": 0.4, "nothing": 0.6}
    assert faint.hear(*weighed(("current_gain",), **unlikely), model("current_gain")) is None


def test_what_stands_in_the_place_of_what_was_found_is_not_more():
    outcome, models = weighed(clock_skew=0.98, inertia=0.02)
    assert faint.hear(outcome, models, model("cogging")) is None


@pytest.mark.parametrize(
    ("effects", "is_noise", "left", "expected"),
    [
        ((), True, 0.0, True),
        ((), False, 0.3, True),  # a test says more than noise, and no effect gained enough by a search
        ((), False, 5.0, False),  # far more: what could say what it is has been fitted
        (("inertia",), True, 0.0, True),  # a further one may be too faint for a test
        (("inertia",), False, 5.0, False),
        (("inertia", "stribeck", "cogging"), True, 0.0, False),  # no more are looked for
    ],
)
def test_the_score_is_asked_where_about_noise_is_left(effects, is_noise, left, expected):
    answer = Model(tuple(SimpleNamespace(effect=name) for name in effects), None, 1.0 + left)
    assert faint.may_hide_something(answer, SimpleNamespace(is_noise=is_noise)) == expected


def test_rivals_are_asked_for_where_about_noise_is_left_without_an_effect(monkeypatch):
    """Beside the drag: without it far more than noise is left, and first order says nothing there."""
    asked = []

    def fit(search, model, n, least, known):
        asked.append((model.names, known))
        return ["a rival"]

    monkeypatch.setattr(faint, "fit_faint_effects", fit)
    left = {("drag", "stribeck"): 0.0, ("drag",): 0.3, ("stribeck",): 45.0, (): 48.0, ("drag", "inertia"): 0.2}

    def fitted(names, excess=0.0):
        effects = [SimpleNamespace(way=(name, ("size",))) for name in names]
        return SimpleNamespace(names=names, effects=effects, excess=excess)

    weighed = [fitted(names, excess) for names, excess in left.items()]
    assert faint.fit_rivals(None, weighed[0], weighed) == ["a rival"]
    assert asked == [(("drag",), {frozenset((name, ("size",)) for name in names) for names in left})]
    assert faint.fit_rivals(None, fitted(()), weighed) == []
