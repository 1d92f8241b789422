"""Laws that the rows need, and laws that they do not: no more false needs than is stated."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from balance_on_paper import PLAIN, motion, rows

from ema.discrepancy.axis.balance.laws.law import BY_RECORD, Law, one
from ema.discrepancy.axis.balance.regressing.choice import _is_ruled_out
from ema.discrepancy.axis.balance.regressing.needed import ALARM, Asked, chance, families_held, is_needed
from ema.discrepancy.axis.balance.regressing.regression import regress

M = motion()
NOISE = 0.01


def law(key, column, family=""):
    return Law(family or key, key, key, lambda m, _: (column(m),), {"c": "N m"}, one("c"), "{c}", "")


DRAG = law("drag", lambda m: m.w * np.abs(m.w))
CUBIC = law("cubic", lambda m: m.w**3)
SPRING = law("spring", lambda m: m.theta)
CONSTANT = law("constant", lambda m: np.ones(len(m.t)))


def made(torque=0.0, noise=NOISE, seed=0):
    found = rows(M, torque, noise, seed)
    return replace(found, sigma=np.full(len(found.y), noise), known={})


def asked(found, *every):
    return Asked.of(float(np.var(found.drive)) * len(found.y), every)


def models(found, *laws):
    return regress(found, PLAIN, laws), regress(found, PLAIN, [])


def test_by_chance_alone_a_law_is_no_chance_as_often_as_p_says():
    p = []
    for seed in range(400):
        new, old = models(made(seed=seed), DRAG)
        p.append(chance(new, old, [DRAG]))
    assert np.mean(np.array(p) < 0.2) == pytest.approx(0.2, abs=0.06)  # three deviations of 400 draws
    assert np.mean(np.array(p) < ALARM) < 0.025


def test_alarms_are_shared_among_families_and_members():
    one_family = Asked(1.0, Counter({"drag": 1}))
    shared = Asked(1.0, Counter({"drag": 4, "spring": 1}))
    assert one_family.level(DRAG) == ALARM
    assert shared.level(DRAG) == ALARM / 8
    assert shared.level(SPRING) == ALARM / 2


def test_a_law_that_acts_is_needed_and_one_that_does_not_is_not():
    found = made(2e-3 * M.w * np.abs(M.w))
    new, old = models(found, DRAG)
    assert is_needed(new, old, asked(found, DRAG))
    beside = regress(found, PLAIN, [DRAG, SPRING])
    assert not is_needed(beside, new, asked(found, DRAG, SPRING))


def test_what_takes_little_of_what_is_left_is_not_needed_however_sure():
    found = made(6e-4 * M.w * np.abs(M.w), noise=0.02)
    new, old = models(found, DRAG)
    assert chance(new, old, [DRAG]) < 1e-4
    assert old.loss - new.loss < 0.1 * old.loss
    assert not is_needed(new, old, asked(found, DRAG))


def test_beside_a_rest_what_is_small_against_the_drive_is_a_part_of_the_rest():
    """The same gain is needed where it takes what is more than noise."""
    torque = 2e-5 * M.w * np.abs(M.w)
    quiet = made(torque, noise=1e-5)
    new, old = models(quiet, DRAG)
    assert old.loss - new.loss < 3e-4 * asked(quiet, DRAG).whole
    assert is_needed(new, old, asked(quiet, DRAG))
    rest = made(torque + 3e-4 * np.sign(np.sin(40.0 * M.t)), noise=1e-5)
    new, old = models(rest, DRAG)
    assert old.loss - new.loss > 0.1 * old.loss
    assert not is_needed(new, old, asked(rest, DRAG))


def test_a_law_that_takes_much_of_the_drive_is_needed_beside_any_rest():
    found = made(2e-3 * M.w * np.abs(M.w) + 2e-2 * np.sign(np.sin(40.0 * M.t)))
    new, old = models(found, DRAG)
    assert new.loss > 0.5 * (old.loss - new.loss)
    assert is_needed(new, old, asked(found, DRAG))


def test_what_a_law_does_is_no_doubt_of_it():
    """Where it is all that is left, blocks disagree by noise alone, however unequal it is in them."""
    found = made(2e-3 * M.w * np.abs(M.w), noise=1e-4)
    new, old = models(found, DRAG)
    assert chance(new, old, [DRAG]) < 1e-60


def test_of_two_that_each_act_in_a_part_of_the_blocks_none_is_clearly_better():
    one_, two = (law(f"{f} Hz", lambda m, f=f: np.sin(2.0 * np.pi * f * m.t)) for f in (7, 9))
    first = M.t < 0.72 * M.t[-1]
    found = made(np.where(first, one_.columns(M, None)[0], two.columns(M, None)[0]) * 0.05)
    better, worse = regress(found, PLAIN, [one_]), regress(found, PLAIN, [two])
    assert worse.loss - better.loss > 0.1 * worse.loss
    assert not is_needed(better, worse, asked(found, one_, two))


def test_of_two_laws_neither_of_which_holds_the_other_the_true_one_is_clearly_better():
    found = made(2e-3 * M.w * np.abs(M.w))
    drag, _ = models(found, DRAG)
    spring, _ = models(found, SPRING)
    assert is_needed(drag, spring, asked(found, DRAG, SPRING))
    assert not is_needed(spring, drag, asked(found, DRAG, SPRING))
    again = models(found, law("drag again", lambda m: m.w * np.abs(m.w)))[0]
    assert not is_needed(again, drag, asked(found, DRAG))


def test_a_spring_holds_a_constant_and_what_is_by_record_the_same_for_all():
    assert families_held("spring") == ("constant",)
    assert families_held("pendulum" + BY_RECORD)[0] == "pendulum"
    assert set(families_held("spring" + BY_RECORD)) == {"spring", "constant", "constant" + BY_RECORD}
    assert families_held("quadratic drag") == ()


def test_a_law_that_is_in_the_model_already_adds_nothing():
    found = made(2e-3 * M.w * np.abs(M.w))
    new, _ = models(found, DRAG)
    twice = law("twice", lambda m: 2.0 * m.w * np.abs(m.w))
    assert chance(regress(found, PLAIN, [DRAG, twice]), new, [twice]) == 1.0


def ruled_out(found, own, other):
    return _is_ruled_out(found, PLAIN, regress(found, PLAIN, [own]), own, regress(found, PLAIN, [other]))


def test_a_rival_that_is_idle_beside_the_law_is_ruled_out_and_never_the_other_way_round():
    found = made(2e-3 * M.w * np.abs(M.w))
    assert ruled_out(found, DRAG, CUBIC)
    assert not ruled_out(found, CUBIC, DRAG)


def test_where_both_act_or_neither_none_is_ruled_out():
    both = made(2e-3 * M.w * np.abs(M.w) + 2e-3 * M.w**3)
    assert not ruled_out(both, DRAG, CUBIC)
    assert not ruled_out(both, CUBIC, DRAG)
    nothing = made()
    assert not ruled_out(nothing, DRAG, SPRING)
