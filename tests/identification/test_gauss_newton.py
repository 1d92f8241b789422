"""The iteration on a made-up model, whose truth and noise are known."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import NOISE, A, N

from ema.core.status import Reason, Status
from ema.identification import Measurement
from ema.identification.fit import unseparable
from ema.identification.gauss_newton import GaussNewton, Options
from ema.identification.linear import Linear

START = np.zeros(2)


def model(k: np.ndarray, start: np.ndarray | None) -> np.ndarray:
    return np.tanh(1.5 * k) @ A.T


def iterative(**options) -> GaussNewton:
    return GaussNewton("made-up", model, NOISE, lambda m: np.zeros(6), Options(**options))


@pytest.mark.parametrize("options", [{}, {"dk": 0.05}])
def test_the_truth_is_found_from_far_away(options):
    k = np.array([0.6, 0.1, 0.9, 0.0, 0.3, 0.5])
    e = iterative(**options).estimate(Measurement.complete(model(k, None), START))
    assert np.allclose(e.k, k, atol=2e-3)
    assert e.status == Status.VALID


def test_intervals_cover_and_the_test_of_fit_keeps_its_level():
    rng = np.random.default_rng(8)
    K = rng.uniform(0, 0.05, (300, 6))
    made = Linear(np.zeros(N), A, NOISE)
    estimates = [made.estimate(Measurement.complete(A @ k + 0.01 * rng.standard_normal(N), START)) for k in K]
    for level in (0.5, 0.9, 0.95):
        low, high = np.moveaxis(np.array([e.interval(level) for e in estimates]), -1, 0)
        assert abs(np.mean((low <= K) & (high >= K)) - level) < 0.03
    p = np.array([e.p_value for e in estimates])
    assert 0.02 < np.mean(p < 0.05) < 0.09
    assert np.mean(p < 0.001) < 0.015


def test_bounds_are_kept_and_said():
    e = iterative().estimate(Measurement.complete(model(np.zeros(6), None) - A @ np.full(6, 0.2), START))
    assert (e.k >= 0).all()
    assert e.reasons & Reason.AT_BOUND


def test_a_foreign_signal_puts_the_model_in_doubt():
    e = iterative().estimate(Measurement.complete(np.random.default_rng(5).standard_normal(N), START))
    assert e.reasons & Reason.MODEL_IN_DOUBT
    assert e.status == Status.DEGRADED


def test_a_combination_the_data_leave_open_is_named():
    B = A.copy()
    B[:, 3] = B[:, 2]  # two faults with one signature
    open_directions = unseparable(np.linalg.pinv(B.T @ B / 1e-4 + 1e-3 * np.eye(6)))
    assert len(open_directions) == 1
    assert np.allclose(np.abs(open_directions[0]), [0, 0, 0.5**0.5, 0.5**0.5, 0, 0], atol=1e-3)


def test_nothing_is_made_up_from_nothing():
    e = iterative().estimate(Measurement(np.full(N, np.nan), None, np.zeros(N, bool)))
    assert e.status == Status.NOT_ESTIMATED
    assert np.isnan(e.interval(0.9)).all()
