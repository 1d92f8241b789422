"""Effects that a test of all that is left passes over: which are told, and when nothing is."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.actuator import faint
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.engine.posterior import Entry


def weighed(**p):
    """Posterior of sets by their names, `nothing` for faults alone, and a model of each."""
    names = {name: () if name == "nothing" else (name,) for name in p}
    outcome = Outcome([Entry(names[name], x, 0.0, 0.0) for name, x in p.items()], [])
    return outcome, [SimpleNamespace(names=of) for of in names.values()]


@pytest.fixture(autouse=True)
def credible(monkeypatch):
    monkeypatch.setattr(faint, "is_credible", lambda model: "incredible" not in model.names)


def test_what_is_sure_is_told_with_all_that_it_may_be():
    model, others = faint.hear(*weighed(clock_skew=0.7, inertia=0.26, cogging=0.03, nothing=0.01))
    assert model.names == ("clock_skew",)
    assert others == ("inertia",)


def test_nothing_is_told_where_faults_alone_may_do_or_what_leads_is_no_cause():
    assert faint.hear(*weighed(nothing=0.999, cogging=0.001)) is None
    assert faint.hear(*weighed(clock_skew=0.9, nothing=0.1)) is None  # likelier, and not sure
    assert faint.hear(*weighed(incredible=0.99, nothing=0.01)) is None
    assert faint.hear(*weighed(nothing=1.0)) is None


@pytest.mark.parametrize(
    ("effects", "is_noise", "left", "expected"),
    [
        ((), True, 0.0, True),
        ((), False, 0.3, True),  # a test says more than noise, and no effect gained enough by a search
        ((), False, 5.0, False),  # far more: what could say what it is has been fitted
        (("inertia",), True, 0.0, False),
    ],
)
def test_the_score_is_asked_where_nothing_was_found_in_about_noise(effects, is_noise, left, expected):
    model, verdict = SimpleNamespace(effects=effects, excess=left), SimpleNamespace(is_noise=is_noise)
    assert faint.may_hide_something(model, verdict) == expected


def test_rivals_are_asked_for_where_about_noise_is_left_without_an_effect(monkeypatch):
    """Beside the drag: without it far more than noise is left, and first order says nothing there."""
    asked = []

    def fit(search, model, n, known):
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
