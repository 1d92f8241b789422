"""The model's error between the sizes and kinds of faults at which it was measured."""

from __future__ import annotations

import numpy as np
import pytest

from ema.identification.noise import N_START, NoiseModel, spread

SIZES = np.array([0.1, 0.2, 0.4])
FEW, MANY = np.diag([1.0, 0.0]), np.diag([0.0, 1.0])
MODEL_ERROR = np.array([[size**4 * shape for size in SIZES] for shape in (FEW, MANY)])
NO_START = (*np.zeros((2, 2, 2)), np.zeros((2, N_START)), np.ones(2))
NOISE = NoiseModel(1e-9 * np.eye(2), SIZES, np.array([1 / 6, 1.0]), MODEL_ERROR, *NO_START)


def test_spread_of_one_and_of_all():
    assert spread(np.array([[0, 0, 0.3, 0, 0, 0], [0.2] * 6])) == pytest.approx([1 / 6, 1.0])


@pytest.mark.parametrize("size", [0.1, 0.15, 0.2, 0.3, 0.4, 0.6])
def test_a_power_of_the_size_is_followed(size):
    alone, together = np.eye(6)[3] * size, np.ones(6) * size / 6**0.5
    assert NOISE.of_model(alone) == pytest.approx(size**4 * FEW, rel=1e-6, abs=1e-12)
    assert NOISE.of_model(together) == pytest.approx(size**4 * MANY, rel=1e-6, abs=1e-12)


def test_without_faults_a_model_does_not_err():
    assert not NOISE.of_model(np.zeros(6)).any()
    assert np.trace(NOISE.of_model(np.full(6, 1e-3))) < 1e-3 * np.trace(MODEL_ERROR[1, 0])


def test_an_error_never_seen_stays_none():
    none = NoiseModel(np.eye(2), SIZES, np.array([0.2, 0.8]), 0.0 * MODEL_ERROR, *NO_START)
    assert np.allclose(none.covariance(np.zeros(2), np.full(6, 0.3)), np.eye(2))


def test_an_inexact_start_widens_by_what_it_moves():
    B = np.zeros((2, N_START))
    B[0, 0], B[0, 2], B[1, 1] = 3.0, 10.0, 5.0  # of θ_u, of θ_u k₁, of θ_m/GR
    rest = (np.eye(2), SIZES, np.array([0.2, 0.8]), 0.0 * MODEL_ERROR, *np.zeros((2, 2, 2)), B, np.full(2, 1e-4))
    exact, inexact = NoiseModel(*rest), NoiseModel(*rest, start_sd=np.array([1e-5, 0.0]))
    k = np.array([0.2, 0, 0, 0, 0, 0])
    added = inexact.covariance(np.zeros(2), k) - exact.covariance(np.zeros(2), k)
    assert added == pytest.approx(np.diag([(0.1 * (3.0 + 0.2 * 10.0)) ** 2, 0.0]), rel=0.1)
    assert inexact.covariance(None, k) == pytest.approx(exact.covariance(None, k))
