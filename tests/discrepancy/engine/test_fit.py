"""Ridges and bent valleys are walked to the truth, whatever columns scatter."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.engine.fit import best_of, fit

M = 40


def _bounds(p: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.full(p, -1e4), np.full(p, 1e4), np.full(p, 5.0)


def _ridge(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two columns with a cosine of 0.9999, and a third."""
    a, b, c = (x / np.linalg.norm(x) for x in rng.standard_normal((3, M)))
    b -= (a @ b) * a
    b /= np.linalg.norm(b)
    cosine = 0.9999
    A = np.stack([a, cosine * a + np.sqrt(1.0 - cosine**2) * b, c], axis=1)
    assert A[:, 0] @ A[:, 1] == pytest.approx(cosine)
    return A, np.array([600.0, -560.0, 10.0])


@pytest.mark.parametrize("seed", range(4))
def test_a_ridge_is_walked_to_its_end_though_simulations_scatter(seed):
    """Along it the truth is 8σ of the record from where the fit begins; a difference of columns is all noise."""
    rng = np.random.default_rng([seed, 7])
    A, truth = _ridge(rng)
    y = A @ truth
    scatter = rng.standard_normal((1 << 12, M)) * 0.3

    def residuals(x: np.ndarray) -> np.ndarray:
        """Each point has a scatter of its own, the same whenever it is asked for."""
        of = [hash(tuple(np.round(row, 9))) % len(scatter) for row in x]
        return np.asarray(y - x @ A.T - scatter[of])

    found = fit(residuals, np.zeros(3), *_bounds(3))
    miss = np.linalg.norm(A @ (found.x - truth))
    assert miss < 2.0  # [σ]
    weak = np.linalg.svd(A)[2][-1]
    assert abs(weak @ (found.x - truth)) < 0.25 * abs(weak @ truth)


def test_a_bent_valley_is_walked_to_the_truth():
    """The response is straight along x and bent by its square: banana-shaped contours, 500 times longer than wide."""
    truth = np.array([30.0, 100.0])

    def response(x: np.ndarray) -> np.ndarray:
        return np.stack([0.3 * x[:, 0], 15.0 * (x[:, 1] - x[:, 0] ** 2 / 9.0)], axis=1)

    def residuals(x: np.ndarray) -> np.ndarray:
        return np.asarray(response(truth[None]) - response(x))

    low, high, _ = _bounds(2)
    found = fit(residuals, np.array([-30.0, 100.0]), low, high, np.array([2.0, 2.0]), turns=40)
    assert found.x == pytest.approx(truth, abs=1.0)


def test_bounds_hold_and_what_leads_beyond_ends_on_them():
    A = np.eye(2)
    found = fit(lambda x: np.array([-5.0, 3.0]) - x @ A, np.ones(2), np.zeros(2), np.full(2, 10.0), np.ones(2))
    assert found.x == pytest.approx([0.0, 3.0], abs=1e-6)


def test_two_valleys_are_two_fits_and_the_deeper_comes_first():
    def residuals(x: np.ndarray) -> np.ndarray:
        """Valleys at ±20; the one at +20 is 9 deeper."""
        return np.stack([(x[:, 0] ** 2 - 400.0) / 40.0, 3.0 * (x[:, 0] < 0.0)], axis=1)

    starts = [np.array([s]) for s in (-25.0, -15.0, 15.0, 25.0)]
    found = best_of(residuals, starts, np.array([-100.0]), np.array([100.0]), np.array([1.0]))
    assert [float(f.x[0]) for f in found] == pytest.approx([20.0, -20.0], abs=0.1)
