"""Fitted hypotheses on one scale: the true one leads with its size, look-alikes share, none is surer than its noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.engine.contest import Contest, Entrant, Outcome
from ema.discrepancy.engine.posterior import Entry, p_cause
from ema.discrepancy.engine.records import OwnRecordsError, Pool, seeds, simulate
from ema.discrepancy.engine.statistic import Prediction, Root, Statistic, shrinkage, shrunk_correlation

NAMES = ("a", "b", "c")
SETS = (("magnet",), 0.03), ((), 0.07), (("drag",), 0.9)  # a short in each


def entrant(toy, *causes: str, **point: float) -> Entrant:
    there = tuple(c for c in toy.causes if c.name in causes)
    parameters = [*toy.faults, *(p for c in there for p in c.parameters)]
    return Entrant(there, point, np.array([toy.columns[p.name] for p in parameters]).T)


def held(toy, *entrants: Entrant, n_records: int = 16) -> Outcome:
    return Contest(toy, entrants, toy.whitening(), n_records, lambda text: None).run(entrants)


def test_the_true_cause_leads_and_its_size_is_within_its_deviations(toys):
    """Begun a quarter off: what is simulated anew ends at the truth, for a cause and a fault at once."""
    z = []
    for seed in range(12):
        toy = toys.plant(2, NAMES, seed=seed, truth={"a.size": 12.0, "k1": 5.0})
        others = [entrant(toy, name, **{f"{name}.size": 3.0}) for name in "bc"]
        outcome = held(toy, entrant(toy, k1=4.0), entrant(toy, "a", **{"a.size": 9.0}, k1=6.0), *others)
        leader = outcome.weighed[0]
        assert leader.entrant.names == ("a",)
        assert sum(e.probability for e in outcome.posterior) == pytest.approx(1.0)
        sd = dict(zip((p.name for p in leader.parameters), leader.evidence.sd, strict=True))
        z += [(leader.point[name] - x) / sd[name] for name, x in toy.truth.items()]
    assert np.std(z) == pytest.approx(1.0, abs=0.45)  # of 24, to 99.9 %


def test_causes_that_do_the_same_share_the_probability(toys):
    toy = toys.plant(1, NAMES, seed=3)
    toy.columns["b.size"] = toy.columns["a.size"]
    toy.measured = toy.measured + 12.0 * toy.columns["a.size"]
    outcome = held(toy, entrant(toy), *(entrant(toy, name, **{f"{name}.size": 12.0}) for name in "ab"))
    assert [p_cause(outcome.posterior, name) for name in "ab"] == pytest.approx([0.5, 0.5], abs=0.01)
    assert p_cause(outcome.posterior, "c") == 0.0


def test_faults_alone_stand_where_they_do_it(toys):
    toy = toys.plant(2, NAMES, seed=5, truth={"k2": 8.0})
    outcome = held(toy, entrant(toy, k2=8.0), entrant(toy, "a", k2=8.0), entrant(toy, "a", "b", k2=8.0))
    assert outcome.posterior[0].causes == ()
    assert outcome.posterior[0].probability > 0.8
    assert outcome.weighed[0].evidence.p_fault == pytest.approx([0.0, 1.0], abs=0.3)


@pytest.mark.parametrize("faults", [{}, {"k1": 4.0}])
def test_neither_nothing_nor_a_fault_is_a_cause(toys, faults):
    """Of forty records without a cause none has one with 0.9."""
    for seed in range(20):
        toy = toys.plant(2, NAMES, seed=seed, truth=faults)
        outcome = held(toy, entrant(toy, **faults), *(entrant(toy, name, **faults) for name in NAMES))
        assert all(p_cause(outcome.posterior, name) < 0.9 for name in NAMES), seed


def test_a_cancelling_pair_is_not_bought(toys):
    """It fits better by far; what a law may leave is the same for all."""
    rng = np.random.default_rng([12, 1])
    toy = toys.plant(1, ("true", "large", "larger"), seed=12, usual=100.0)
    column = toy.columns["true.size"]
    form, far = rng.standard_normal((2, toy.n)) * np.linalg.norm(column) / np.sqrt(toy.n)
    toy.columns["large.size"], toy.columns["larger.size"] = 10.0 * far + column + 0.05 * form, 10.0 * far
    toy.measured = toy.measured + 100.0 * (column + 0.05 * form)
    one = entrant(toy, "true", **{"true.size": 100.0})
    two = entrant(toy, "large", "larger", **{"large.size": 100.0, "larger.size": -100.0})
    assert held(toy, entrant(toy), one, two).posterior[0].causes == ("true",)


def test_what_a_grid_makes_of_all_blocks_is_part_of_the_noise(toys):
    """The covariance of few records, block by block, is that of many whole ones; of the grid nothing averages out."""
    rng = np.random.default_rng(11)
    of_grid = 2.0 * rng.standard_normal((4, 24))
    toy = toys.plant(1, NAMES, seed=1, grids=4, of_grid=of_grid)
    whitening = toy.whitening()
    statistic = Statistic.of(whitening, whitening.white(np.array(list(toy.columns.values()))).T, 48)
    (many,) = simulate(toy, [{}], Pool.COLUMN, 4000)
    true = np.cov(statistic(many.features)[0].T)
    (few,) = simulate(toy, [{}], Pool.PREDICT, 64)
    found = Prediction.of(statistic, few, toy.measured).covariance
    ratio = np.sort(np.linalg.eigvals(np.linalg.solve(true, found)).real)
    assert ratio[0] > 0.5
    assert ratio[-1] < 2.5  # of 64 records; a grid counts as one of four


def test_a_size_is_told_over_all_sets_that_have_the_cause(toys):
    """Two sets that do the same, with other sizes of what they share: the interval holds both."""
    toy = toys.plant(1, NAMES, seed=3)
    toy.columns["c.size"] = toy.columns["b.size"] + 0.5 * toy.columns["a.size"]
    toy.measured = toy.measured + 10.0 * toy.columns["a.size"] + 8.0 * toy.columns["b.size"]
    sets = (("a", "b"), {"a.size": 10.0, "b.size": 8.0}), (("a", "c"), {"a.size": 6.0, "c.size": 8.0})
    outcome = held(toy, entrant(toy), *(entrant(toy, *names, **point) for names, point in sets))
    (mean, sd), *_ = outcome.sizes("a").values()
    each = [w.point["a.size"] for w in outcome.weighed if "a" in w.entrant.names]
    assert min(each) < mean < max(each)
    assert sd > 0.45 * abs(each[0] - each[1])
    with pytest.raises(KeyError):
        outcome.sizes("nothing")


def test_a_fault_is_told_over_all_sets_with_a_cause_that_it_may_have_stood_for_and_without():
    """A weaker magnet with half the short, or the short alone: the interval holds both."""
    each = [SimpleNamespace(entrant=SimpleNamespace(names=n), point={"k": x}, sd={"k": 1e-4}) for n, x in SETS]
    outcome = Outcome([Entry(n, p, 0.0, 0.0) for (n, _), p in zip(SETS, (0.4, 0.6, 0.0), strict=True)], each)
    mean, sd = outcome.sizes_of_faults(["k"])["k"]
    assert mean == pytest.approx(0.4 * 0.03 + 0.6 * 0.07)
    assert sd == pytest.approx(0.04 * np.sqrt(0.4 * 0.6), rel=1e-4)


def test_where_a_response_is_not_linear_the_interval_holds_what_other_points_say(toys):
    """A response with ripples: about each point alone the deviation is too small, about three together it is true."""
    alone, together = [], []
    for seed in range(16):
        toy = toys.plant(1, NAMES, seed=seed, usual=10.0)
        toy.bend = lambda point, toy=toy: 1.5 * np.sin(2.0 * point.get("a.size", 0.0)) * toy.columns["a.size"]
        truth = 20.0 + 0.4 * seed
        toy.measured = toy.measured + toy.mean({"a.size": truth})
        starts = [entrant(toy, "a", **{"a.size": truth + off}) for off in (-1.5, 0.2, 1.5)]
        for of, found in ((starts[:1], alone), (starts, together)):
            mean, sd = held(toy, entrant(toy), *of).sizes("a")["a.size"]
            found.append((mean - truth) / sd)
    assert np.mean(np.square(together)) < 0.6 * np.mean(np.square(alone))
    assert np.max(np.abs(together)) < 4.0


def test_a_direction_that_is_hardly_felt_is_told_no_better_than_points_along_it_say(toys):
    """Columns of a and b that nearly cancel, by noisy differences: each point claims to know its place."""
    alone, together = [], []
    for seed in range(24):
        toy = toys.plant(1, NAMES, seed=seed, usual=100.0)
        rng = np.random.default_rng([seed, 7])
        toy.columns["b.size"] = toy.columns["a.size"] + 0.02 * toy.columns["b.size"]
        toy.measured = toy.measured + toy.mean({"a.size": 50.0, "b.size": -20.0})
        ended = 30.0 * rng.choice([-1.0, 1.0]) + np.array([-8.0, 2.0, 8.0])  # along the ridge, to one side
        points = [entrant(toy, "a", "b", **{"a.size": 50.0 + x, "b.size": -20.0 - x}) for x in ended]
        points = [replace(p, columns=p.columns + 0.1 * rng.standard_normal(p.columns.shape)) for p in points]
        for of, found in ((points[1:2], alone), (points, together)):
            mean, sd = held(toy, entrant(toy), *of).sizes("b")["b.size"]
            found.append((mean + 20.0) / sd)
    assert np.sqrt(np.mean(np.square(alone))) > 3.0
    assert np.sqrt(np.mean(np.square(together))) < 1.5


def test_whitening_by_ones_own_records_is_refused(toys):
    toy = toys.plant(2, NAMES)
    columns = np.array(list(toy.columns.values()))
    for pool, refused in ((Pool.PREDICT, True), (Pool.COLUMN, False)):
        whitening = toy.whitening(seeds(pool, 48))
        statistic = Statistic.of(whitening, whitening.white(columns).T, 48)
        (records,) = simulate(toy, [{}], Pool.PREDICT, 16)
        if refused:
            with pytest.raises(OwnRecordsError, match="another pool"):
                Prediction.of(statistic, records, toy.measured)
        else:
            assert len(Prediction.of(statistic, records, toy.measured).mean) == statistic.basis.shape[1]


def test_the_error_of_the_evidence_is_what_other_records_would_move_it_by(toys):
    """Halves of the records foretell how the evidence scatters over other records."""
    z, errors = [], []
    for other in range(40):
        toy = toys.plant(2, NAMES, seed=3, truth={"a.size": 30.0})
        made = toy.records
        toy.records = lambda points, of, made=made, other=other: made(
            points, range(of.start + 100 * other, of.stop + 100 * other)
        )
        off = entrant(toy, "a", **{"a.size": 26.0})  # so that the mean's own noise counts
        (w,) = Contest(toy, [entrant(toy), off], toy.whitening(), 24, lambda text: None).weigh([off])
        z.append(w.log_evidence)
        errors.append(w.error)
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) / np.std(z) < 2.0


def test_the_root_of_a_correlation_whitens_as_the_whole_matrix_does():
    """More features than rows: the same squares as by the inverse, at the price of the rows."""
    rng = np.random.default_rng(17)
    z = rng.standard_normal((20, 60)) @ (np.eye(60) + 0.4 * np.eye(60, k=2))
    z /= np.sqrt((z**2).mean(axis=0))
    x, y = rng.standard_normal((2, 5, 60))
    root = Root.of(z)
    assert root(x) @ root(y).T == pytest.approx(x @ np.linalg.solve(shrunk_correlation(z), y.T), rel=1e-9)
    assert root.inverse(root(x)) == pytest.approx(x, rel=1e-9, abs=1e-12)
    r = z.T @ z / 19
    off = ~np.eye(60, dtype=bool)
    variance = ((z**2).T @ (z**2) / 19 - r**2) / 20
    assert shrinkage(z) == pytest.approx(variance[off].sum() / (r[off] ** 2).sum(), rel=1e-9)
