"""The iteration on a noisy model, on a made-up one: a plane, and an error field that the smooth model does not know."""

from __future__ import annotations

import numpy as np
import pytest

from ema.identification import Measurement
from ema.identification.gauss_newton import GaussNewton
from ema.identification.hf import HfInLoop
from ema.identification.noise import N_START, NoiseModel

N, N_WAVES, N_CYCLES = 20, 60, 48
SIGMA = 0.01  # of switching [A]
RNG = np.random.default_rng(8)
A = RNG.standard_normal((N, 6))
SHAPES = A[:, :4] + RNG.standard_normal((N, 4))  # directions in which the smooth model errs, some as faults move
SIZES = np.array([0.1, 0.5])


def noise(size: float) -> NoiseModel:
    """What the builder knows of a model that errs by `size` at any k. [A]"""
    M = size**2 * SHAPES @ SHAPES.T
    zero = np.zeros((N, N))
    return NoiseModel(SIGMA**2 * np.eye(N), SIZES, np.array([0.4, 0.9]), np.tile(M, (2, 2, 1, 1)), zero, zero,
                      np.zeros((N, N_START)), np.full(2, 2e-4))  # fmt: skip


def field(length: float, size: float, rng: np.random.Generator):
    """An error e(k) of the correlation assumed, with this length, as waves (its spectrum is Student's t)."""
    w = rng.standard_normal((N_WAVES, 6)) * np.sqrt(3.0 / rng.chisquare(3.0, (N_WAVES, 1))) / length
    c = size * np.sqrt(2.0 / N_WAVES) * rng.standard_normal((N_WAVES, 4)) @ SHAPES.T
    phase = rng.uniform(0.0, 2.0 * np.pi, N_WAVES)
    return lambda k: np.cos(k @ w.T + phase) @ c


def claims(length: float, size: float, uneven: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each cycle: shares of faults within their 50 and 90 % intervals, errors in claimed variances, errors.

    `uneven`: standard deviation of the logarithm of what cycles' noise at each instant is, over the builder's.
    """
    held, squares, errors = [], [], []
    for seed in range(N_CYCLES):
        rng = np.random.default_rng(seed)
        e, sigma = field(length, size, rng), SIGMA * np.exp(uneven * rng.standard_normal(N))
        first = GaussNewton("lf2", lambda x, start: x @ A.T, noise(size), lambda m: np.full(6, 0.2))

        def simulated(x, start, e=e, rng=rng, sigma=sigma):
            return x @ A.T + e(x) + sigma * rng.standard_normal((len(x), N))

        k = rng.uniform(0.1, 0.4, 6)
        found = HfInLoop(simulated, first).estimate(Measurement.complete(simulated(k[None], None)[0], np.zeros(2)))
        limits = [found.interval(level).T for level in (0.5, 0.9)]
        held.append([((low <= k) & (k <= high)).mean() for low, high in limits])
        squares.append((found.k - k) @ np.linalg.solve(found.covariance, found.k - k) / 6.0)
        errors.append(found.k - k)
    return np.array(held), np.array(squares), np.array(errors)


@pytest.mark.parametrize(("length", "size", "uneven"), [(0.1, 0.05, 0.0), (0.2, 0.03, 0.0), (0.2, 0.03, 0.7)])
def test_intervals_hold_what_they_claim_however_rough_the_error_is_and_uneven_the_noise(length, size, uneven):
    held, squares, _ = claims(length, size, uneven)
    share, error = held.mean(axis=0), held.std(axis=0, ddof=1) / np.sqrt(N_CYCLES)
    print(share, error, squares.mean())
    assert (np.abs(share - [0.5, 0.9]) < 0.03 + 2.0 * error).all()
    assert squares.mean() == pytest.approx(1.0, abs=0.4)  # 2.4 where what the runs leave open is forgotten


def test_runs_make_the_answer_better_than_the_smooth_model_allows():
    *_, errors = claims(0.2, size=0.03)
    alone = np.linalg.inv(A.T @ np.linalg.solve(noise(0.03).covariance(np.zeros(2), np.full(6, 0.1)), A))
    best = np.linalg.inv(A.T @ A) * SIGMA**2
    assert np.mean(errors**2) < 0.5 * np.trace(alone) / 6.0
    assert np.mean(errors**2) < 3.0 * np.trace(best) / 6.0
