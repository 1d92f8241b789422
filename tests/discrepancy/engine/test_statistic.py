"""Few simulated records tell how much one differs: neither more nor less than records that were not used."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz

from ema.discrepancy.engine.hypothesis import Block
from ema.discrepancy.engine.records import Simulated
from ema.discrepancy.engine.statistic import Prediction, Statistic, Whitening

N_RECORDS, GRIDS, N_BLOCKS, D = 16, 4, 6, 22  # as an actuator's record of six cycles has them
N_TOYS = 40


def statistic_of(rng: np.random.Generator) -> Statistic:
    """Statistics on random directions of features that are whitened already, apart in each block."""
    blocks = tuple(Block(slice(2 * D * b, 2 * D * (b + 1)), 0) for b in range(N_BLOCKS))
    n = 2 * D * N_BLOCKS
    basis = np.linalg.qr(rng.standard_normal((n, D)))[0]
    return Statistic(Whitening(np.ones(n), {0: lambda x: x}, blocks, range(0)), basis)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_covariance_of_few_records_is_that_of_others(correlation):
    """A factor for the inverse of few rows had made it 1.5 times as large, and intervals of 50 % hold 70 %."""
    rng = np.random.default_rng(5)
    root = np.linalg.cholesky(toeplitz(correlation ** np.arange(2 * D)))
    squares = []
    for _ in range(N_TOYS):
        statistic = statistic_of(rng)
        noise = rng.standard_normal((N_RECORDS + 100, N_BLOCKS, 2 * D)) @ root.T
        of, others = np.split(noise.reshape(len(noise), -1), [N_RECORDS])
        found = Prediction.of(statistic, Simulated(of, range(1, 1 + N_RECORDS), GRIDS), np.zeros(of.shape[1]))
        away = statistic(others - of.mean(axis=0))[0]
        squares.append(np.einsum("ij,ij->", away, np.linalg.solve(found.covariance, away.T).T) / away.size)
    assert 0.85 < np.mean(squares) < 1.15
