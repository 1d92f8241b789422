"""The examination on toy plants, which are linear and known to the last digit: milliseconds each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from toy_plant import N_BLOCKS, QUIET, N, Toy

from ema.discrepancy.examine import examine
from ema.discrepancy.fitting import best_fit, fit, jacobian
from ema.discrepancy.held_out import by_record, over_folds, residual_over_folds, training_errors
from ema.discrepancy.plant import Candidate, Free
from ema.discrepancy.progress import Progress
from ema.discrepancy.rounds import State, drop_unneeded, leave_out, revise, select
from ema.discrepancy.selection import fit_base, fit_with_each, split_into_folds
from ema.discrepancy.trust import at_bound, describe_effects, drop_unlikely
from ema.discrepancy.verdict import correlation_test, judge, scale_test
from ema.discrepancy.weighing import weigh_sets


class Mimicked(Toy):
    """Two candidates of one effect, each of which the base parameter could be taken for."""

    def candidates(self, point, blocks):
        free = Free("a.size", "N m", -5.0, 5.0, 0.1, 0.1)
        return [Candidate(f"a by {way}", "a", (free,), ({"a.size": 0.1},)) for way in ("day", "night")]


def test_what_the_base_parameters_could_be_taken_for_is_told_by_its_effect_once():
    plant = Mimicked(3)
    plant.columns["a"] = plant.columns["k"]
    assert examine(plant).mimicked == ("a",)


def test_of_forty_toys_with_nothing_hidden_none_has_an_effect():
    for seed in range(40):
        outcome = examine(Toy(seed, k=0.3))
        assert outcome.verdict == "adequate", seed
        assert outcome.effects == []
        assert outcome.k_after[0] == pytest.approx(0.3, abs=5.0 * outcome.k_error[0])


@pytest.mark.parametrize("seed", range(5))
def test_a_hidden_effect_is_named_with_its_size_and_what_is_gained(seed):
    outcome = examine(Toy(seed, ("a", "b", "c"), k=-0.2, b=0.8))
    (found,) = outcome.effects
    assert found["name"] == "b"
    assert found["indistinguishable_from"] == []
    assert found["confidence"] > 0.9
    assert np.mean(found["parameters"]["b.size"]) == pytest.approx(0.8, abs=0.1)
    assert outcome.verdict == "explained"
    assert outcome.folds.err_after < 1.1 < outcome.folds.err_before
    assert outcome.train[1] < outcome.train[0]


def test_two_effects_with_one_column_cannot_be_told_apart():
    toy = Toy(1, ("a", "b"), a=0.8)
    toy.columns["b"] = toy.columns["a"] + 1e-6 * toy.columns["b"]
    (found,) = examine(toy).effects
    assert {found["name"], *found["indistinguishable_from"]} == {"a", "b"}
    assert found["confidence"] < 0.6


def test_what_no_effect_can_do_is_unexplained():
    outcome = examine(Toy(3, others=0.5))
    assert outcome.verdict == "unexplained"
    assert outcome.effects == []


def test_an_effect_that_a_later_one_makes_superfluous_is_left_out():
    toy = Toy(4, ("a", "b"), b=0.8)
    plain = fit_base(toy)
    trials = fit_with_each(toy, plain, toy.candidates, str)
    both = fit_with_each(toy, trials["a"], toy.candidates, str)["b"]
    assert [c.key for c in both.accepted] == ["a", "b"]
    assert [c.key for c in leave_out(toy, both, {0}).accepted] == ["b"]
    progress = Progress()
    state = State(plain, plain, [], [])
    select(toy, state, progress)
    assert [c.key for c in state.model.accepted] == ["b"]
    trust, weighed = drop_unlikely(toy, state, progress)
    assert trust["b"] > 0.9
    final = fit(toy, [*toy.base, *state.model.accepted[0].free], state.model.fits[0].point, range(N_BLOCKS))
    (told,) = describe_effects(toy, state, {"b": 1.0}, weighed, final.point, final.draw)
    assert told["name"] == "b"


def _found_beside_what_is_not_there(toy):
    """A selection that took `a`, which is not there, before `b`, which is."""
    plain = fit_base(toy)
    first = fit_with_each(toy, plain, toy.candidates, str)
    second = fit_with_each(toy, first["a"], toy.candidates, str)
    return State(plain, second["b"], [(first, plain), (second, first["a"])], [])


def test_what_stays_alone_is_weighed_against_what_looks_like_it_alone():
    toy = Toy(4, ("a", "b", "c"), b=0.8)
    toy.columns["c"] = toy.columns["b"] + 1e-6 * toy.columns["c"]
    state = _found_beside_what_is_not_there(toy)
    revise(toy, state, Progress())
    weighed = weigh_sets(state.plain, state.model, state.rounds)
    p = {e.causes: e.probability for e in weighed.entries}
    assert p["b",] + p["c",] > 0.9
    assert 0.2 < p["b",] / p["c",] < 5.0


def test_a_fit_that_ended_in_a_side_minimum_gives_way_to_a_better_one_of_the_same_effects():
    toy = Toy(5, ("a", "b"), a=0.8, b=0.8)
    state = _found_beside_what_is_not_there(toy)
    away = {"k": 0.0, "a.size": 0.5, "b.size": 0.8}
    state.model = replace(state.model, held_out=tuple(toy.residuals([away], range(N_BLOCKS))[0]))
    assert state.model.rms > 1.03
    revise(toy, state, Progress())
    assert {c.key for c in state.model.accepted} == {"a", "b"}
    assert state.model.rms == pytest.approx(1.0, abs=0.03)


def test_fits_are_least_squares_within_bounds():
    toy = Toy(5, ("a",), a=0.7, k=0.4)
    blocks = range(N_BLOCKS)
    free = [*toy.base, *toy.candidates({}, blocks)[0].free]
    found = fit(toy, free, {"k": 0.0, "a.size": 0.1}, blocks)
    A = np.stack([toy.columns[n].ravel() for n in ("k", "a")], axis=1)
    exact, *_ = np.linalg.lstsq(A, toy.y.ravel(), rcond=None)
    assert [found.point["k"], found.point["a.size"]] == pytest.approx(exact, abs=0.02)  # Huber's weights
    assert jacobian(toy, free, found.point, blocks) == pytest.approx(-A, abs=1e-6)
    sd = np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    wider = np.sqrt(np.diag(found.covariance)) / sd
    assert (wider > 0.99).all()
    assert (wider < 1.0 + 3.0 / np.sqrt(2.0 * N_BLOCKS)).all()  # by no more than blocks disagree by chance
    low = [Free("k", "1", 0.5, 1.0, 0.5, 0.1), free[1]]
    held = best_fit(toy, low, [{"k": 0.6, "a.size": x} for x in (0.1, 1.0, 2.0)], blocks)
    assert held.point["k"] == 0.5
    assert at_bound(Free("k", "1", 0.5, 1.0, 0.5, 0.1), held.point["k"])
    assert not at_bound(Free("k", "1", 0.0, 1.0, 0.5, 0.1), 0.0)  # off


def test_what_is_known_beforehand_counts_as_a_measurement():
    toy = Toy(6, (), k=0.8)
    A, y = toy.columns["k"].ravel(), toy.y.ravel()
    sd = float(1.0 / np.linalg.norm(A))  # as sure as the records are
    found = fit(toy, [Free("k", "1", -1.0, 1.0, 0.0, 0.1, prior=sd)], {"k": 0.0}, range(N_BLOCKS))
    assert found.point["k"] == pytest.approx(0.5 * (A @ y) / (A @ A), rel=0.05)


def test_gains_are_of_parts_that_were_not_fitted():
    toy = Toy(7, ("a",), a=1.0)
    plain = fit_base(toy)
    with_a = fit_with_each(toy, plain, toy.candidates, str)["a"]
    of = split_into_folds(toy.blocks)
    assert sorted(j for out in of for j in out) == list(range(N_BLOCKS))
    gain = over_folds(toy, plain, with_a)
    assert gain.err_before == pytest.approx(np.sqrt(2.0), rel=0.1)
    assert gain.err_after == pytest.approx(1.0, rel=0.05)
    assert residual_over_folds(toy, plain, with_a).err_after == pytest.approx(with_a.rms, rel=0.02)
    (record,) = by_record(toy, plain, with_a)
    assert record.err_after < record.err_before
    assert training_errors(toy, plain, with_a)[1] <= gain.err_after * 1.02


def test_noise_is_told_from_what_is_larger_or_correlated():
    rng = np.random.default_rng(8)
    alarms = sum(not judge([rng.standard_normal((1, 400)) for _ in range(4)]).is_noise for _ in range(2000))
    assert alarms <= 3  # of 2000, at 1 in 4000 each
    larger = [1.2 * rng.standard_normal((1, 400)) for _ in range(4)]
    assert not judge(larger).is_noise
    assert scale_test(larger, 1, 0.0, 0) < 1e-6
    assert judge(larger, noise_uncertainty=0.2).is_noise  # noise that is known to a fifth only
    x = rng.standard_normal((4, 1, 401))
    moving = list((x[..., 1:] + 0.3 * x[..., :-1]) / np.sqrt(1.09))
    assert correlation_test(moving) < 1e-6
    assert "correlated" in judge(moving).because or not judge(moving).is_noise


class Opposed(Toy):
    """`a` and `b` do the opposite, but for a tenth: what both leave is all that is seen of them."""

    def __init__(self, seed: int, **hidden: float):
        super().__init__(seed)
        common, *own = (self.columns[name].copy() for name in ("a", "b", "k"))
        self.columns |= {"a": 10.0 * common + own[0], "b": own[1] - 10.0 * common}
        self.columns["k"] = np.random.default_rng(seed + 1000).standard_normal(common.shape)
        self.y = QUIET * np.random.default_rng(seed).standard_normal(common.shape)
        self.y = self.y + sum(size * self.columns[name] for name, size in hidden.items())

    def seen_together(self, point):
        return self.candidates(point, range(N_BLOCKS))


@pytest.mark.parametrize("seed", range(3))
def test_two_effects_of_which_neither_alone_foretells_much_are_found_where_both_are_seen(seed):
    toy = Opposed(seed, a=2.0, b=2.0)
    assert examine(toy).effects == []
    found = examine(toy, together=toy.seen_together)
    assert {e["name"] for e in found.effects} == {"a", "b"}
    assert found.verdict == "explained"


@pytest.mark.parametrize("seed", range(3))
def test_what_is_seen_together_and_is_not_there_is_not_named(seed):
    toy = Opposed(seed, a=2.0)
    assert {e["name"] for e in examine(toy, together=toy.seen_together).effects} == {"a"}
    nothing = Opposed(seed)
    assert examine(nothing, together=nothing.seen_together).verdict == "adequate"


class Uneven(Toy):
    """A few vigorous parts show what `a`, `b` and `c` do, and show each of them beside the other two only."""

    def __init__(self, seed: int, **hidden: float):
        super().__init__(seed, ("a", "b", "c"))
        rng = np.random.default_rng(seed)
        vigour = np.exp(1.5 * rng.standard_normal((N_BLOCKS, 1, 1)))
        self.columns |= {name: vigour * self.columns[name] for name in self.effects}
        self.columns["k"], noise = rng.standard_normal((2, N_BLOCKS, 1, N))
        self.y = QUIET * noise + sum(size * self.columns[name] for name, size in hidden.items())


@pytest.mark.parametrize("seed", range(40))
def test_of_three_effects_the_first_may_gain_no_more_than_chance_by_itself(seed):
    toy = Uneven(seed, a=2.0, b=2.0, c=2.0)
    found = examine(toy)
    assert {e["name"] for e in found.effects} == {"a", "b", "c"}
    assert found.verdict in ("explained", "partly explained")


def test_an_effect_that_only_moved_the_base_out_of_a_side_minimum_goes():
    """The fit without effects had stopped in one; left out again, the effect is worth nothing."""
    toy = Toy(6, ("a",), k=0.6)
    stuck = replace(fit_base(toy), held_out=tuple(toy.residuals([{"k": 0.0}], range(N_BLOCKS))[0]))
    beside = fit_with_each(toy, stuck, toy.candidates, str)["a"]
    state = State(stuck, beside, [({"a": beside}, stuck)], [])
    drop_unneeded(toy, state, Progress())
    assert state.model.accepted == ()
    assert state.plain.rms == pytest.approx(1.0, abs=0.1)
