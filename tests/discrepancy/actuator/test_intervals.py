"""Intervals of faults: the score's, and the doubt about a rest which nothing explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.core.names import FAULTS
from ema.discrepancy.actuator.telling import intervals

FREE = [SimpleNamespace(name=name) for name in FAULTS]
SCORE, FITTED = 1e-4, 5e-3


@pytest.fixture
def model():
    sd = dict.fromkeys(FAULTS, FITTED)
    fit = SimpleNamespace(point={"k1": 0.03}, sd=sd, free=FREE, columns={})
    return SimpleNamespace(names=(), fit=fit)


@pytest.fixture
def outcome():
    w = SimpleNamespace(
        entrant=SimpleNamespace(names=()), sd=dict.fromkeys(FAULTS, SCORE),
        point=dict.fromkeys(FAULTS, 0.0) | {"k1": 0.03},
    )  # fmt: skip
    return SimpleNamespace(
        weighed=[w], sizes_of_faults=lambda faults: {name: (w.point[name], w.sd[name]) for name in faults}
    )


def test_a_fault_is_told_by_the_score_and_by_the_fit_where_its_set_was_not_weighed(model, outcome):
    """A fit keeps a short of 0.2 % that is not there; the score drops it."""
    model.fit.point = {"k1": 0.031, "k3": 0.002}
    told = intervals.of_faults(model, outcome)
    assert told["k1"] == intervals.Size(0.03, SCORE)
    assert told["k3"].value == 0.0
    outcome.weighed.clear()
    assert intervals.of_faults(model, outcome)["k3"] == intervals.Size(0.002, FITTED)


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
        return intervals.hold_rest(search, model, {"k1": known, "k2": known})

    known = intervals.Size(0.03, 1e-4)
    assert told(0.0)["k1"] == known
    assert told(30.0)["k1"].sd == pytest.approx(intervals.FORM * 0.03, rel=1e-3)
    assert told(30.0)["k2"] == known
