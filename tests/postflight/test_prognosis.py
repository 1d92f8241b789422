"""Remaining life: calibrated on simulated histories, silent where the trend says nothing."""

import numpy as np
import pytest
from ema_postflight.prognosis import MIN_POINTS, Trend, prognosis

from benchmarks import prognosis as bench


def _told(t, k, sd=0.005, threshold=0.3):
    rng = np.random.default_rng(3)
    return prognosis(Trend(t, k + sd * rng.standard_normal(len(t)), np.full(len(t), sd)), threshold, rng)


def test_a_steady_growth_is_continued():
    t = np.linspace(0, 1000, 200)
    found = _told(t, 0.2 * t / 1000)
    assert found.silent == ""
    low, median, high = found.life
    assert low < 500 < high
    assert median == pytest.approx(500, rel=0.15)


def test_time_may_be_in_any_unit():
    t = np.linspace(0, 1, 200)
    seconds, days = _told(t, 0.2 * t), _told(t * 86400, 0.2 * t)
    assert days.life == pytest.approx(86400 * seconds.life)


def test_the_same_history_gives_the_same_answer():
    t = np.linspace(0, 1000, 200)
    assert np.array_equal(_told(t, 2e-4 * t).draws, _told(t, 2e-4 * t).draws)


@pytest.mark.parametrize(
    ("k", "reason"),
    [
        (lambda t: np.full_like(t, 0.02), "no growth"),
        (lambda t: 0.1 - 0.05 * t, "no growth"),
        (lambda t: 0.02 + 0.03 * t, "farther away"),
        (lambda t: 0.25 + 0.2 * t, "reached already"),
    ],
    ids=["constant", "falling", "far", "reached"],
)
def test_a_trend_that_supports_none_is_told_so(k, reason):
    t = np.linspace(0, 1, 200)
    found = _told(t, k(t))
    assert reason in found.silent
    assert np.isnan(found.life).all()


def test_too_few_or_useless_estimates():
    t = np.linspace(0, 1, 50)
    nan = np.full(50, np.nan)
    rng = np.random.default_rng(1)
    assert "fewer" in prognosis(Trend(t[: MIN_POINTS - 1], t[: MIN_POINTS - 1], np.ones(MIN_POINTS - 1)), 1, rng).silent
    assert "fewer" in prognosis(Trend(t, nan, nan), 1, rng).silent
    assert "one time" in prognosis(Trend(np.zeros(50), t, np.ones(50)), 1, rng).silent


@pytest.mark.slow
def test_intervals_hold_what_they_promise():
    """A binomial share of about 150 told histories: three standard deviations."""
    told, _ = bench.run(210, seed=77)
    n = sum(not one.prognosis.silent for one in told)
    print(f"{n} of 210 told, coverage 50 %: {bench.coverage(told, 0.5):.3f}, 90 %: {bench.coverage(told, 0.9):.3f}")
    assert n > 100
    for share in (0.5, 0.9):
        assert abs(bench.coverage(told, share) - share) <= 3 * np.sqrt(share * (1 - share) / n)


@pytest.mark.slow
def test_what_never_fails_is_hardly_ever_given_a_life():
    told, _ = bench.run(60, seed=78, families=bench.NEVER)
    assert sum(not one.prognosis.silent for one in told) <= 4
