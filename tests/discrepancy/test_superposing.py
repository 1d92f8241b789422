"""Sets of effects that explain more together than what was found one by one, on toy plants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest
from toy_plant import N_BLOCKS, Toy

from ema.discrepancy.examine import examine
from ema.discrepancy.progress import Progress
from ema.discrepancy.rounds import State, revise, select
from ema.discrepancy.selection import fit_base, fit_with_each, superpose
from ema.discrepancy.superposing import rank_sets


class Common(Toy):
    """`c` does what `a` and `b` have in common, but for a part, and `d` most of that part."""

    def __init__(self, seed: int, **hidden: float):
        super().__init__(seed, ("a", "b", "c", "d", "e", "f"))
        noise = self.y.copy()
        u, v = np.random.default_rng(seed + 500).standard_normal((2, *noise.shape))
        a, b = self.columns["a"], self.columns["b"]
        self.columns |= {"c": a + b + 0.35 * u, "d": u + 0.5 * v}
        self.y = noise + sum(size * self.columns[name] for name, size in hidden.items())


def found_one_by_one(toy):
    plain = fit_base(toy)
    state = State(plain, plain, [], [])
    select(toy, state, Progress())
    revise(toy, state, Progress())
    return {c.key for c in state.model.accepted}


@pytest.mark.parametrize("seed", range(5))
def test_two_effects_are_found_where_a_third_does_what_they_have_in_common(seed):
    toy = Common(seed, a=1.0, b=1.0)
    assert "c" in found_one_by_one(toy)
    found = examine(toy)
    assert {e["name"] for e in found.effects} == {"a", "b"}
    assert found.verdict == "explained"


@pytest.mark.parametrize("seed", range(5))
def test_what_two_effects_have_in_common_is_found_where_it_is_there(seed):
    assert {e["name"] for e in examine(Common(seed, c=1.0)).effects} == {"c"}
    assert {e["name"] for e in examine(Common(seed, c=1.0, d=-0.5)).effects} == {"c", "d"}


def test_between_two_sets_an_answer_is_right_as_often_as_it_says():
    stated, right = [], []
    for seed in range(80):
        size = 0.4 if seed % 4 < 2 else 0.6
        hidden = {"c": size} if seed % 2 else {"a": size, "b": size}
        best = examine(Common(seed, **hidden)).posterior[0]
        stated.append(best["probability"])
        right.append(set(best["effects"]) == set(hidden))
    assert min(stated) < 0.8
    assert binomtest(sum(right), len(right), float(np.mean(stated))).pvalue > 0.01, (sum(right), np.sum(stated))


def test_what_a_set_should_leave_is_what_its_fit_leaves():
    """Effects of a toy are linear."""
    toy = Common(2, a=0.5, b=-0.7, e=0.4)
    plain = fit_base(toy)
    alone = fit_with_each(toy, plain, toy.candidates, str)
    ranked = rank_sets(toy, plain.fits, {key: t.fits for key, t in alone.items()}, 3)
    left, best = ranked[0]
    assert set(best) == {"a", "b", "e"}
    tried = superpose(toy, plain, [alone[key] for key in best])
    rows = np.concatenate([r.ravel() for fitted in tried.fits for r in fitted.residuals])
    assert left == pytest.approx(np.mean(rows**2), rel=2e-3)
    assert sorted(len(j.blocks) for j in tried.fits) == [N_BLOCKS // 2] * 2


def test_two_that_do_the_same_have_no_amplitudes_of_their_own():
    toy = Toy(3, ("a", "b", "c"), a=0.8, c=0.5)
    toy.columns["b"] = toy.columns["a"]
    plain = fit_base(toy)
    alone = {key: t.fits for key, t in fit_with_each(toy, plain, toy.candidates, str).items()}
    ranked = rank_sets(toy, plain.fits, alone, 2)
    assert {frozenset(names) for _, names in ranked[:2]} == {frozenset("ac"), frozenset("bc")}
    assert dict((frozenset(n), x) for x, n in ranked)[frozenset("ab")] > 1.2


class BesideATerm(Common):
    """The same, where `e` is the largest and has no name in the library."""

    def candidates(self, point, blocks):
        return [c for c in super().candidates(point, blocks) if c.key != "e"]

    def structure(self, point, blocks):
        return [replace(c, is_structure=True) for c in super().candidates(point, blocks) if c.key == "e"]


def test_a_set_beside_a_larger_term_without_a_name_is_told_and_not_named():
    """What only that term explains is unknown, and more than what the two do."""
    found = examine(BesideATerm(1, a=1.0, b=1.0, e=3.0))
    assert found.verdict == "unexplained"
    assert found.effects == []
    assert {"a", "b"} <= {row["name"] for row in found.lost}
