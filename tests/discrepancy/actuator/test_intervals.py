"""Intervals: the fit's doubt beside the same faults, and that about a rest which nothing explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.core.names import FAULTS
from ema.discrepancy.actuator import intervals
from ema.discrepancy.findings import WITHIN

FREE = [SimpleNamespace(name=name) for name in FAULTS]
SCORE, BESIDE, FITTED = 1e-4, 1e-3, 5e-3


@pytest.fixture
def model():
    sd = dict.fromkeys(FAULTS, FITTED)
    fit = SimpleNamespace(point={"k1": 0.03}, sd=sd, free=FREE, columns={})
    return SimpleNamespace(names=(), fit=fit)


@pytest.fixture
def outcome():
    w = SimpleNamespace(
        entrant=SimpleNamespace(names=()), sd=dict.fromkeys(FAULTS, SCORE),
        point=dict.fromkeys(FAULTS, 0.0) | {"k1": 0.03}, sd_beside=lambda free: dict.fromkeys(free, BESIDE),
    )  # fmt: skip
    return SimpleNamespace(weighed=[w])


def test_a_deviation_is_the_fits_less_the_doubt_about_faults_that_the_score_has_dropped(model, outcome):
    assert intervals.deviation("k1", SCORE, model, outcome) == pytest.approx(SCORE * FITTED / BESIDE)
    assert intervals.deviation("k1", 2.0 * BESIDE, model, outcome) == FITTED  # none dropped: the wider of both
    model.fit.sd["k1"] = 0.1 * BESIDE  # a fit may not narrow it
    assert intervals.deviation("k1", SCORE, model, outcome) == SCORE
    outcome.weighed.clear()
    assert intervals.deviation("k1", SCORE, model, outcome) == SCORE


def test_a_fault_holds_fit_and_score_and_stays_between_nothing_and_all(model, outcome):
    model.fit.sd = dict.fromkeys(FAULTS, 0.01)
    outcome.weighed[0].point["k1"] = 0.15
    low, high = intervals.of_faults(None, model, outcome, is_noise=True)[0]
    assert low == 0.0
    assert high > 0.15  # where the two disagree it holds both
    model.fit.point["k1"] = 0.99
    outcome.weighed.clear()
    low, high = intervals.of_faults(None, model, outcome, is_noise=True)[0]
    assert low == pytest.approx(0.99 - WITHIN * 0.01)
    assert high == 1.0


def test_a_fault_may_be_what_a_rest_of_its_own_size_is_in_the_balance_where_it_acts(model, outcome, monkeypatch):
    """Columns of a thousand deviations per unit: 0.03 is as large as a rest of thirty; k2 acts in another balance."""
    J = 1e3 * np.eye(len(FAULTS))
    monkeypatch.setattr(intervals, "stacked_jacobian", lambda *of: J)
    data = SimpleNamespace(motion=[0])
    plant = SimpleNamespace(data=data, slices=[{"torque": slice(0, 1), "gap": slice(1, 6)}])
    noise = SimpleNamespace(of=lambda c: SimpleNamespace(fresh=np.zeros((4, 6))))
    search = SimpleNamespace(plant=plant, noise=noise, train=[0])

    def told(rest: float):
        model.fit.residuals = {0: np.array([rest, 0.0, 0.0, 0.0, 0.0, 0.0])}
        model.fit.point["k2"] = 0.03
        return intervals.of_faults(search, model, outcome, is_noise=False)

    model.fit.sd, outcome.weighed[0].sd = dict.fromkeys(FAULTS, 1e-4), dict.fromkeys(FAULTS, 1e-4)
    outcome.weighed[0].point["k2"] = 0.03
    assert told(0.0)[0][0] == pytest.approx(0.03 - WITHIN * 1e-4, abs=1e-5)
    assert 0.0 < told(15.0)[0][0] < told(0.0)[0][0]
    assert told(32.0)[0][0] == 0.0
    assert told(32.0)[1] == told(0.0)[1]
