"""The whole search on toy plants: what is there is named, nothing is not, and no pair that cancels is bought."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.engine.hypothesis import Hypothesis
from ema.discrepancy.engine.posterior import p_cause
from ema.discrepancy.engine.records import OwnRecordsError, Pool, seeds, simulated
from ema.discrepancy.engine.search import search
from ema.discrepancy.engine.statistic import Prediction, Statistic, Whitening
from ema.discrepancy.engine.weighing import Budget, Scale

QUICK = Budget(records=48, width=2, rounds=3, at_most=2, turns=4)
NAMES = ("a", "b", "c", "d")


@pytest.mark.parametrize("faults", [{}, {"k1": 4.0}])
def test_neither_nothing_nor_a_fault_is_a_cause(toys, faults):
    """Of forty records without a cause none has one with 0.9, and the test of what is left refuses hardly any."""
    alarms, refused = 0, 0
    for seed in range(20):
        answer = search(toys.plant(2, NAMES, seed=seed, truth=faults), QUICK)
        alarms += any(p_cause(answer.posterior, name) > 0.9 for name in NAMES)
        refused += not answer.is_foretold
    assert alarms == 0
    assert refused <= 1


@pytest.mark.parametrize("truth", [{"b.size": 8.0}, {"c.size": -10.0, "k1": 5.0}])
def test_a_cause_is_named_beside_a_fault_with_its_size(toys, truth):
    answer = search(toys.plant(2, NAMES, seed=4, truth=truth), QUICK)
    cause = next(name for name in truth if name.endswith(".size"))
    leader = answer.leader
    assert leader.hypothesis.causes == (cause.split(".")[0],)
    assert p_cause(answer.posterior, cause.split(".")[0]) > 0.99
    names = [p.name for p in leader.parameters]
    for name, value in truth.items():
        j = names.index(name)
        assert leader.evidence.mean[j] == pytest.approx(value, abs=4.0 * leader.evidence.sd[j])
    assert answer.is_foretold
    assert any(row["name"] == "faults only" and row["nats"] < -5.0 for row in answer.rejected)


def test_two_causes_are_found_one_after_the_other(toys):
    answer = search(toys.plant(2, NAMES, seed=6, truth={"a.size": 10.0, "d.size": -9.0}), QUICK)
    assert set(answer.leader.hypothesis.causes) == {"a", "d"}
    assert answer.posterior[0].probability > 0.9


def test_what_is_outside_the_library_is_not_foretold(toys):
    rng = np.random.default_rng([8, 1])
    answer = search(toys.plant(2, NAMES, seed=8, law=4.0 * rng.standard_normal(24)), QUICK)
    assert not answer.is_foretold


def _cancelling(toys):
    """The truth is one cause whose law is 5 % another; two that cancel leave just what it is."""
    rng = np.random.default_rng([12, 1])
    toy = toys.plant(1, ("true", "large", "larger"), seed=12, usual=100.0)
    column = toy.columns["true.size"]
    form, far = rng.standard_normal((2, toy.n)) * np.linalg.norm(column) / np.sqrt(toy.n)
    toy.columns["large.size"] = 10.0 * far + column + 0.05 * form
    toy.columns["larger.size"] = 10.0 * far
    toy.measured = toy.measured + 100.0 * (column + 0.05 * form)
    return toy


def test_a_cancelling_pair_does_not_win(toys):
    """It fits better by far, and is not bought: what a law may leave is the same for all hypotheses."""
    toy = _cancelling(toys)
    scale = Scale(toy, QUICK, {})
    null, one, two = (
        Hypothesis(()),
        Hypothesis(("true",), {"true.size": 100.0}),
        Hypothesis(("large", "larger"), {"large.size": 100.0, "larger.size": -100.0}),
    )
    exactly = [scale.weigh(h).log_evidence for h in (one, two)]
    assert exactly[1] > exactly[0] + 20.0  # as if laws were exact, it would be bought
    scale.learn_law_error(scale.weigh(null))
    one_, two_ = (scale.weigh(h).log_evidence for h in (one, two))
    assert one_ > two_
    assert search(toy, QUICK).leader.hypothesis.causes == ("true",)


def test_whitening_by_ones_own_records_is_refused(toys):
    toy = toys.plant(2, NAMES)
    (records,) = simulated(toy, [{}], Pool.WHITEN, 48)
    whitening = Whitening.of(records, toy.blocks, toy.floors)
    statistic = Statistic.of(whitening, whitening.white(np.array(list(toy.columns.values()))).T, 48)
    with pytest.raises(OwnRecordsError, match="another pool"):
        Prediction.of(statistic, records, toy.measured)
    (others,) = simulated(toy, [{}], Pool.PREDICT, 48)
    assert Prediction.of(statistic, others, toy.measured).n_records == 48


def test_pools_never_share_a_seed_and_have_an_end():
    pools = [seeds(pool, 100) for pool in Pool]
    assert len({seed for pool in pools for seed in pool}) == 100 * len(Pool)
    with pytest.raises(ValueError, match="pool TEST"):
        seeds(Pool.TEST, 10, first=999_995)


def test_the_error_of_the_evidence_is_what_other_records_would_move_it_by(toys):
    """Halves of the records foretell the scatter of the evidence over disjoint sets of records."""
    toy = toys.plant(2, NAMES, seed=3, truth={"a.size": 30.0})
    budget = Budget(records=24)
    scale = Scale(toy, budget, {})
    h = Hypothesis(("a",), {"a.size": 26.0})  # off, so that the mean's own noise counts
    J = scale.columns(h.point, scale.parameters(h.causes))
    x = np.array([0.0, 0.0, 26.0])
    z, errors = [], []
    for first in range(0, 24 * 60, 24):
        (records,) = simulated(toy, [h.point], Pool.PREDICT, 24, first)
        prediction = Prediction.of(scale.statistic, records, toy.measured)
        z.append(scale.integrated(h.causes, prediction, J, x).log_z)
    errors = [scale.weigh(h, J).error]
    assert 0.0 < errors[0] < 3.0 * float(np.std(z))
