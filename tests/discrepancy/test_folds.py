"""The gain over folds: what it is, how sure it is, and that one lucky part does not decide."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from ema.discrepancy.findings import Findings, Gain
from ema.discrepancy.folds import Folds, deal


def folds(after, before=None, floor=0.01):
    n = len(after)
    before = before if before is not None else np.full(n, 0.05)
    squares = [tuple(np.square(x).tolist()) for x in (before, after, np.full(n, floor))]
    return Folds(tuple(f"cycle {j}" for j in range(n)), *squares, (1.0,) * n)


def gain(f):
    return Gain(0.05, 0.01, f.err_before, f.err_after, f.noise_floor, folds=f)


def test_the_errors_are_root_mean_squares_of_all_parts():
    f = folds([0.01, 0.02], [0.03, 0.04])
    assert f.err_before == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 2))
    assert f.gain == pytest.approx(f.err_before - np.sqrt((0.01**2 + 0.02**2) / 2))


def test_the_error_of_the_gain_is_what_other_records_would_give():
    """Against the spread over many records drawn alike."""
    rng = np.random.default_rng(24)
    print("seed 24")
    drawn = [folds(0.01 * (1.0 + 0.2 * rng.random(12)), 0.05 + 0.01 * rng.standard_normal(12)) for _ in range(300)]
    spread = np.std([f.gain for f in drawn])
    assert np.mean([f.gain_error for f in drawn]) == pytest.approx(spread, rel=0.15)


def test_one_part_alone_has_no_error_and_the_file_stays_json():
    f = folds([0.01])
    assert f.gain_error == float("inf")
    said = Findings("explained", [], gain(f)).as_dict()["gain"]
    assert json.loads(json.dumps(said, allow_nan=False))["folds"]["gain_error"] is None


def test_every_part_is_left_out_once_and_neighbours_are_apart():
    groups = deal(range(20), 8)
    assert sorted(x for g in groups for x in g) == list(range(20))
    assert len(groups) == 8
    assert all(b - a > 1 for g in groups for a, b in itertools.pairwise(g))
    assert deal([4, 5], 8) == [[4], [5]]


def test_a_loss_is_told_as_one():
    assert "falls from 0.03 to 0.01 A, by 0.02 ±" in folds([0.01, 0.01], [0.03, 0.03]).sentence(1.0, "A")
    assert "grows from 0.03 to 0.05 A, by 0.02 ±" in folds([0.05, 0.05], [0.03, 0.03]).sentence(1.0, "A")


@pytest.mark.parametrize(
    ("after", "said"), [([0.012, 0.013, 0.014], "is not all"), ([0.004, 0.003, 0.03], "may not be")]
)
def test_a_rest_that_parts_scatter_by_is_not_told_as_sure(after, said):
    rest = Findings("partly explained", [], gain(folds(after))).sentences()[-1]
    assert said in rest
    assert "±" in rest
