"""The verdict claims no more than what held-out parts and the test of the whole record say together."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ema.discrepancy.findings import Findings, FoundEffect, Gain
from ema.discrepancy.folds import Folds
from ema.discrepancy.grade import LIMIT, Left, grade

SPRING = FoundEffect("spring_load", 0.99, (), {}, "a spring", "slow motion")


def folds(*rests):
    """Parts that leave so many times what noise makes of them."""
    after = tuple((0.01 * np.array(rests)) ** 2)
    n = len(rests)
    return Folds(tuple(f"cycle {j}" for j in range(n)), (1e-2,) * n, after, (1e-4,) * n, (1.0,) * n)


def left(is_chance, error, residual, is_form=False):
    return Left(is_chance, folds(error, error), folds(residual, residual), is_form)


@pytest.mark.parametrize(
    ("of", "nothing_named", "causes_named"),
    [  # chance, error, residual, form of a law
        ((True, 1.0, 1.0), "adequate", "explained"),
        ((True, 1.1, 1.1), "adequate", "explained"),
        ((True, 1.3, 1.3), "adequate", "partly explained"),  # no alarm without a test that says so, and no claim
        ((False, 0.71, 1.01), "adequate", "explained"),  # correlation that is smaller than the noise
        ((False, 1.07, 1.07), "adequate", "explained"),
        ((False, 1.16, 10.7), "unexplained", "partly explained"),  # an envelope that hides it
        ((False, 1.3, 1.0), "unexplained", "partly explained"),
        ((False, 8.0, 30.0), "unexplained", "partly explained"),
        ((False, 1.1, 4.0, True), "unexplained", "explained"),  # a law of another form, too small to be felt
        ((False, 1.3, 4.0, True), "unexplained", "partly explained"),
    ],
)
def test_the_truth_table(of, nothing_named, causes_named):
    assert grade(left(*of), named=False) == nothing_named
    assert grade(left(*of), named=True) == causes_named


def test_every_case_of_it_holds_what_is_promised():
    """Never explained beyond the limit; a rest needs both that it is no chance and that it is there."""
    around = (0.5, LIMIT - 0.01, LIMIT + 0.01, 50.0)
    for chance, error, residual, form in itertools.product((True, False), around, around, (True, False)):
        of = left(chance, error, residual, form)
        if error > LIMIT:
            assert grade(of, named=True) == "partly explained"
        if chance or max(error, residual) <= LIMIT:
            assert grade(of, named=False) == "adequate"
        else:
            assert grade(of, named=False) == "unexplained"


def test_noise_that_was_estimated_may_be_larger_and_nothing_is_claimed_by_that():
    """A cascade with nothing hidden left 0.71 floors of error and 1.25 of residual, by a noise known to 10 %."""
    known, estimated = (Left(False, folds(0.7, 0.7), folds(1.2, 1.3), noise_uncertainty=u) for u in (0.0, 0.1))
    assert [grade(of, named=False) for of in (known, estimated)] == ["unexplained", "adequate"]
    assert grade(Left(False, folds(5.0, 4.0), folds(9.0, 9.0), noise_uncertainty=0.1), named=False) == "unexplained"
    loud = Left(False, folds(1.25, 1.25), folds(1.0, 1.0), noise_uncertainty=0.1)
    assert grade(loud, named=True) == "partly explained"


def test_one_part_that_runs_away_raises_no_alarm_where_the_residual_is_noise_and_is_no_claim_either():
    """A stage with nothing hidden left 1.75 ± 0.88 floors of its free runs and 1.10 of the residual."""
    away = folds(*[1.0] * 9, 5.0)
    assert grade(Left(False, away, folds(1.1, 1.1)), named=False) == "adequate"
    assert grade(Left(False, away, folds(1.1, 1.1)), named=True) == "partly explained"
    assert grade(Left(False, away, folds(1.1, 3.0)), named=False) == "unexplained"
    assert grade(Left(False, folds(*[1.7] * 9, 1.9), folds(1.1, 1.1)), named=False) == "unexplained"


def test_parts_that_all_leave_many_times_the_noise_are_no_chance_however_they_differ():
    """Of a real double pendulum, by block: a mean of 37 ± 26 of a skewed ratio, of which no block leaves noise."""
    blocks = folds(10.0, 9.3, 6.6, 8.3, 9.5, 17.9, 92.2, 1.9)
    assert grade(Left(False, blocks, folds(1.0, 1.0)), named=False) == "unexplained"
    lucky = folds(1.0, 1.1, 0.9, 1.0, 1.1, 1.0, 12.0, 0.9)
    assert grade(Left(False, lucky, folds(1.0, 1.0)), named=False) == "adequate"


def test_what_happens_once_is_no_chance_and_is_told_with_its_part():
    """A coupling that slipped once left 3.08 floors of the residual in one part of 17, and 1.24 ± 0.25 in the mean."""
    usual = (0.98, 0.95, 1.02, 1.01, 0.97, 0.99, 1.0, 0.96, 1.02)
    slipped = Left(False, folds(*[1.0] * 9, 16.0), folds(*usual, 3.08), noise_uncertainty=0.1)
    assert slipped.residual.rest < slipped.allowed
    assert grade(slipped, named=False) == "unexplained"
    assert "cycle 9 leaves 3.08 times the noise, every other part at most 1.02" in slipped.event
    assert "something happened there" in slipped.event
    assert grade(Left(True, folds(*[1.0] * 10), folds(*usual, 3.08)), named=False) == "adequate"
    assert grade(Left(False, folds(*[1.0] * 10), folds(*usual, 3.08)), named=True) == "partly explained"
    for parts in ((*usual, 1.5), (*usual[:8], 2.1, 2.2), (0.9, 1.3, 1.7, 2.1), (1.0, 3.0)):
        assert Left(False, folds(*parts), folds(*parts)).event == ""


def test_what_is_strongest_in_one_part_and_in_others_too_did_not_happen_once():
    """An inertia that grows with speed left 15.8 floors in the quickest part of 12, and up to 4.3 in others."""
    parts = folds(1.1, 1.3, 1.2, 2.0, 4.3, 1.5, 1.1, 1.2, 1.4, 1.3, 1.2, 15.8)
    told = Left(False, parts, parts).event
    assert "most of it there" in told
    assert "happened" not in told


def test_one_lucky_part_does_not_make_it_explained():
    """The part that a single split would have held out is at noise; the others are not."""
    unlucky = folds(1.0, 1.5, 1.5, 1.5, 1.5, 1.5)
    assert grade(Left(False, folds(1.0), folds(1.0)), named=True) == "explained"
    assert grade(Left(False, unlucky, folds(1.0)), named=True) == "partly explained"


def test_what_is_small_is_told_with_its_error():
    said = Left(False, folds(0.7, 0.9), folds(1.0, 1.1)).sentence
    assert "0.806 ± 0.1 times the noise in their error" in said
    assert "1.05 ± 0.05 times in the residual" in said


def test_what_is_left_is_told_by_what_sees_more():
    gain = Gain(1.0, 0.1, 1.0, 0.1, 0.1, folds=folds(1.0, 1.0), residual=folds(4.0, 5.0))
    said = Findings("partly explained", [SPRING], gain).sentences()
    assert "4.53 times what noise makes" in said[-1]
    assert Findings("partly explained", [SPRING], gain).as_dict()["gain"]["residual"]["rest"] == pytest.approx(
        4.53, abs=0.01
    )
