"""Sets of effects weighed by what held-out parts of a record say: probabilities that are right as often as they say."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binomtest

from ema.discrepancy.engine.posterior import Entry, p_cause, posterior, thin
from ema.discrepancy.fitting import Fit
from ema.discrepancy.plant import Candidate, Free
from ema.discrepancy.selection import Tried
from ema.discrepancy.weighing import Weighed, weigh_sets

N, N_PARTS = 400, 40
N_TOYS = 1000
BINS = (0.0, 0.05, 0.2, 0.5, 0.8, 0.95, 1.0)
NONE, ONE, OTHER = (), ("one",), ("other",)


def toy(rng):
    """A record of noise, or with one of two columns that are nearly alike, and its true set."""
    columns = rng.standard_normal((2, N))
    likeness = rng.uniform(0.8, 1.0)
    columns[1] = likeness * columns[0] + np.sqrt(1.0 - likeness**2) * columns[1]
    true = rng.integers(3)
    size = rng.choice([-1.0, 1.0]) * rng.lognormal(np.log(0.25), 0.7)
    y = rng.standard_normal(N) + (size * columns[true - 1] if true else 0.0)
    return columns, y, (NONE, ONE, OTHER)[true]


def held_out(column, y):
    """What a fit of one column to every other part leaves of the parts that it has not seen."""
    fold = (np.arange(N) * N_PARTS // N) % 2
    r = np.empty(N)
    for f in (0, 1):
        seen = fold != f
        r[~seen] = y[~seen] - column[~seen] * (column[seen] @ y[seen] / (column[seen] @ column[seen]))
    return r


def scores(r):
    return -0.5 * (r**2).reshape(N_PARTS, -1).sum(axis=1)


def test_probabilities_by_parts_are_right_as_often_as_they_say():
    """2 x 2 folds of 1 000 records; the prior is even, as the toys are."""
    rng = np.random.default_rng(20_261_125)
    answers = []
    for _ in range(N_TOYS):
        columns, y, true = toy(rng)
        parts = {NONE: scores(y), ONE: scores(held_out(columns[0], y)), OTHER: scores(held_out(columns[1], y))}
        entries = posterior({names: float(of.sum()) for names, of in parts.items()}, 0.0, parts)
        answers += [(e.probability, e.causes == true) for e in entries]
    p, right = np.array(answers).T
    for low, high in pairwise(BINS):
        inside = (p >= low) & (p <= high)
        stated, n = float(p[inside].mean()), int(inside.sum())
        assert n > 50
        assert binomtest(int(right[inside].sum()), n, stated).pvalue > 1e-3, f"{low} to {high}: {right[inside].mean()}"


def test_a_lead_in_one_part_alone_is_not_sure():
    """Ten nats in all: spread over the record they are sure, of one wild part they are no more than that part."""
    even, wild = np.full(N_PARTS, 10.0 / N_PARTS), np.full(N_PARTS, -0.5)
    wild[7] = 10.0 - wild.sum() + wild[7]
    p = {}
    for name, lead in (("even", even), ("wild", wild)):
        parts = {ONE: lead, OTHER: np.zeros(N_PARTS)}
        entries = posterior({names: float(of.sum()) for names, of in parts.items()}, 0.0, parts)
        p[name] = {e.causes: e.probability for e in entries}[ONE]
    assert p["even"] > 0.999
    assert 0.5 < p["wild"] < 0.8


def model(columns, y, *names):
    """A model of one effect at most, whose residual is held out."""
    candidates = tuple(Candidate(n, n, (Free(n, "1", -5.0, 5.0, 1.0, 0.1),), ({n: 1.0},)) for n in names)
    r = held_out(columns[names[0]], y) if names else y
    fit = Fit((), {}, [], np.eye(0), (), 1.0, np.eye(0))
    return Tried(candidates, (fit, fit), (candidates,) * 2, tuple(part[None] for part in r.reshape(N_PARTS, -1)))


def weighed(likeness, size, *, form=0.0):
    rng = np.random.default_rng(3)
    one, own = rng.standard_normal((2, N))
    columns = {"one": one, "other": likeness * one + np.sqrt(1.0 - likeness**2) * own}
    y = rng.standard_normal(N) + size * one + form * np.abs(one)
    plain, *both = (model(columns, y, *names) for names in (NONE, ONE, OTHER))
    return weigh_sets(plain, both[0], [(dict(zip(columns, both, strict=True)), plain)])


def test_what_is_there_is_sure_and_alone_where_nothing_looks_like_it():
    found = weighed(0.3, 1.0)
    assert list(found.instead("one")) == ["one"]
    assert found.instead("one")["one"] > 0.99
    assert found.described({})[0]["effects"] == ["one"]


def test_a_size_is_as_uncertain_as_it_is_unclear_what_else_is_there():
    """A second effect is as likely as not; with it the first is 1, without 3: points come of both sets, half each.

    A second one that is needed, and may stand for something without a name, leaves the first as it is beside it: a
    spring of 90 N/m was told as 18 to 91.
    """
    frees = {n: Free(n, "1", -5.0, 5.0, 1.0, 0.1) for n in ("one", "other")}
    candidates = {n: Candidate(n, n, (f,), ({n: 1.0},)) for n, f in frees.items()}

    def of(size, *names):
        fit = Fit(tuple(frees[n] for n in names), dict.fromkeys(names, size), [], 1e-6 * np.eye(len(names)), (), 1.0,
                  np.eye(len(names)))  # fmt: skip
        return Tried(tuple(candidates[n] for n in names), (fit, fit), (), ())

    sets = {ONE: of(3.0, "one"), ("one", "other"): of(1.0, "one", "other")}
    both, alone = Entry(("one", "other"), 0.5, 0.0, 0.0), Entry(("one",), 0.5, 0.0, 0.0)
    model = sets[ONE]
    sizes = np.array([p["one"] for p in Weighed([both, alone], sets, {}, {}).draw(1000, model, model.fits[0])])
    assert len(sizes) == pytest.approx(1000, abs=2)
    assert np.mean(np.isclose(sizes, 3.0, atol=0.1)) == pytest.approx(0.5, abs=0.01)
    assert np.mean(np.isclose(sizes, 1.0, atol=0.1)) == pytest.approx(0.5, abs=0.01)
    needed = Weighed([replace(both, probability=1.0)], sets, {}, {}).draw(1000, model, model.fits[0])
    assert np.allclose([p["one"] for p in needed], 1.0, atol=0.1)


def test_what_may_stand_for_something_unknown_takes_its_share_of_every_set():
    sets = {("a", "b"): 0.9, ("a",): 0.1}
    entries = thin([Entry(causes, p, np.log(p), 0.0) for causes, p in sets.items()], {"a": 0.8, "b": 0.5})
    assert sum(e.probability for e in entries) == pytest.approx(1.0)
    assert p_cause(entries, "a") == pytest.approx(0.8)
    assert p_cause(entries, "b") == pytest.approx(0.9 * 0.5)
    assert {e.causes: e.probability for e in entries}[()] == pytest.approx(0.9 * 0.2 * 0.5 + 0.1 * 0.2)


def test_without_anything_fitted_no_probability_is_told():
    rng = np.random.default_rng(3)
    plain = model({}, rng.standard_normal(N))
    assert weigh_sets(plain, plain, []).described({}) == []


def test_what_looks_alike_shares_what_is_sure_of_the_set():
    found = weighed(0.9999, 1.0).instead("one")
    assert set(found) == {"one", "other"}
    assert max(found.values()) < 0.95
    assert sum(found.values()) > 0.99


def test_nothing_is_likelier_than_a_cause_that_the_record_does_not_need():
    assert weighed(0.3, 0.0).described({})[0]["effects"] == []


def test_a_law_of_another_form_makes_likelihoods_less_sure():
    """Where the best leaves 40 times noise, a lead that noise would make sure is less than what the form may be off."""
    assert len(weighed(0.999, 5.0).instead("one")) == 1
    assert len(weighed(0.999, 5.0, form=6.0).instead("one")) == 2


@pytest.mark.parametrize("order", [(ONE, OTHER), (OTHER, ONE)])
def test_probabilities_do_not_depend_on_the_order_of_sets(order):
    parts = {names: np.full(N_PARTS, 0.1 * (names == ONE)) for names in order}
    p = {e.causes: e.probability for e in posterior({n: float(x.sum()) for n, x in parts.items()}, 0.0, parts)}
    assert p[ONE] == pytest.approx(1.0 / (1.0 + np.exp(-4.0)))


def test_two_terms_of_one_key_are_counted_once_each():
    """A sum of two bumps had made probabilities of 2.5."""
    entries = thin([Entry(("a", "bump", "bump"), 1.0, 0.0, 0.0)], {"a": 0.8, "bump": 1.0})
    assert sum(e.probability for e in entries) == pytest.approx(1.0)
    assert p_cause(entries, "a") == pytest.approx(0.8)
