from __future__ import annotations

import numpy as np
import pytest
from ema_offline_builder.config import Schedule

from ema.core.errors import ConfigError
from ema.reduction.schedules import SCHEDULES, Knowledge, schedule


@pytest.fixture(scope="module")
def know() -> Knowledge:
    t = np.linspace(0, 0.5, 1001)
    A = np.array([np.sin(2 * np.pi * f * t) for f in (1, 3, 5, 7, 9, 11)]).T * np.exp(-((t[:, None] - 0.3) ** 2) / 0.01)
    covariance = 1e-4 * np.exp(-np.abs(t[:, None] - t) / 2e-3)
    runs = np.linalg.cholesky(covariance).T  # with their negatives they have this covariance, but for a factor
    return Knowledge(t, A[:, 0], A, np.vstack([runs, -runs]))


@pytest.mark.parametrize("name", SCHEDULES)
@pytest.mark.parametrize("n", [6, 30, 97])
def test_contract(know, name, n):
    """Every schedule: n increasing sample indices within the cycle, the same for the same seed."""
    index = schedule(name, know, n, seed=1)
    assert index.shape == (n,)
    assert (np.diff(index) > 0).all()
    assert index[0] >= 0
    assert index[-1] < len(know.t)
    assert np.array_equal(index, schedule(name, know, n, seed=1))


@pytest.mark.parametrize("name", SCHEDULES)
def test_a_builder_can_ask_for_every_schedule(name):
    assert Schedule(method=name).method == name


def information(know, index):
    A, S = know.A[index], know.covariance(index)
    return np.linalg.slogdet(A.T @ np.linalg.solve(S, A))[1]


@pytest.mark.parametrize("name", ["qr", "greedy"])
def test_schedules_that_know_the_jacobian_gather_more_information(know, name):
    assert information(know, schedule(name, know, 12, 1)) > information(know, schedule("uniform", know, 12, 1)) + 1.0


def test_som_follows_the_mode(know):
    """Where v₁ is steep a neuron covers less time than where it is flat."""
    index = schedule("som", know, 30, 1)
    t = know.t[index]
    busy = np.diff(t[(t > 0.2) & (t < 0.4)]).mean()
    quiet = np.diff(t[t < 0.15]).mean()
    assert busy < quiet


def test_an_unknown_schedule_is_named(know):
    with pytest.raises(ConfigError, match="'best' is unknown; known: som"):
        schedule("best", know, 10, 1)
