"""The jackknife over blocks, against what is known exactly of a mean."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.blocks_left_out import covariance


def of_mean(y: np.ndarray, n_blocks: int) -> np.ndarray:
    """Variance of the mean of y, whose blocks are alike long."""
    left = (y - y.mean()).reshape(n_blocks, -1)
    blocks = [(np.array([[float(len(r))]]), np.array([r.sum()])) for r in left]
    return covariance(np.array([[float(len(y))]]), blocks)


def test_of_independent_samples_it_is_the_variance_of_their_mean():
    y = np.random.default_rng(1).standard_normal(400)
    assert of_mean(y, 400)[0, 0] == pytest.approx(y.var(ddof=1) / 400, rel=0.01)


def test_samples_that_hang_together_within_a_block_count_once():
    """Twenty numbers, each repeated fifty times: the mean is known as from twenty, not as from a thousand."""
    y = np.repeat(np.random.default_rng(2).standard_normal(20), 50)
    assert of_mean(y, 20)[0, 0] == pytest.approx(y.var() / 19, rel=0.01)
    assert of_mean(y, 1000)[0, 0] < of_mean(y, 20)[0, 0] / 40


def test_of_one_block_nothing_is_told():
    assert covariance(np.eye(2), [(np.eye(2), np.ones(2))]) == pytest.approx(np.zeros((2, 2)))


def test_it_is_what_refits_without_each_block_scatter_by_about_their_own_mean():
    """Blocks of unequal length and of unequal size: the refits' mean is then another than the fit of all."""
    rng = np.random.default_rng(3)
    sizes = (40, 7, 3, 25)
    rows = [(rng.standard_normal((n, 2)) * (1.0, n), rng.standard_normal(n) * n) for n in sizes]
    A, y = np.concatenate([x for x, _ in rows]), np.concatenate([z for _, z in rows])
    whole = np.linalg.lstsq(A, y, rcond=None)[0]
    refits = []
    for k in range(len(rows)):
        others = [own for j, own in enumerate(rows) if j != k]
        refits.append(np.linalg.lstsq(*(np.concatenate(x) for x in zip(*others, strict=True)), rcond=None)[0])
    wanted = np.cov(np.array(refits).T) * (len(rows) - 1) ** 2 / len(rows)
    blocks = [(a.T @ a, a.T @ (z - a @ whole)) for a, z in rows]
    assert covariance(A.T @ A, blocks) == pytest.approx(wanted, rel=1e-6)
    about_the_whole = np.array(refits) - whole
    other = about_the_whole.T @ about_the_whole * (len(rows) - 1) / len(rows)
    assert np.abs(other / wanted - 1.0).max() > 0.02  # the test sees which mean it is
