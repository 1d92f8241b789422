"""Two effects that faults stand for: neither gains enough alone, and both together explain what there is."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.actuator.finding import forward

LEFT = 700.0


def model(excess, *, is_full=False):
    return SimpleNamespace(excess=excess, is_full=is_full)


@pytest.fixture
def beside(monkeypatch):
    """What fits of a further effect beside a model leave, least first; counted."""
    asked = []

    def of(*excesses):
        def fit(search, m, screened):
            asked.append(m)
            return [model(x) for x in excesses]

        monkeypatch.setattr(forward, "fit_with_one_more", fit)
        return asked

    monkeypatch.setattr(forward, "rank_to_first_order", lambda search, m: ())
    monkeypatch.setattr(forward, "_keep_owed_to_last", lambda search, models, after: list(models))
    return of


def test_an_effect_that_gains_a_fifth_is_kept_where_another_beside_it_takes_nearly_all(beside):
    beside(4.0, 490.0)
    first, second = model(550.0), model(560.0)
    assert forward.keep_leading_on(None, [first, second], model(LEFT)) == [first]


def test_two_effects_must_take_what_either_must_of_what_the_other_leaves(beside):
    first = model(550.0)
    beside(0.55 * LEFT)
    assert forward.keep_leading_on(None, [first], model(LEFT)) == [first]
    beside(0.57 * LEFT)
    assert forward.keep_leading_on(None, [first], model(LEFT)) == []
    beside()
    assert forward.keep_leading_on(None, [first], model(LEFT)) == []


def test_what_gains_next_to_nothing_or_leaves_no_room_leads_nowhere(beside):
    asked = beside(1.0)
    assert forward.keep_leading_on(None, [model(0.95 * LEFT)], model(LEFT)) == []
    assert forward.keep_leading_on(None, [model(550.0, is_full=True)], model(LEFT)) == []
    assert forward.keep_leading_on(None, [], model(LEFT)) == []
    assert asked == []
