from __future__ import annotations

import numpy as np

from ema.identification.known_error import KnownError, monomials, n_terms


def test_monomials_are_all_of_degree_one_to_four():
    k = np.random.default_rng(1).random((5, 6))
    m = monomials(k)
    assert m.shape == (5, n_terms(6)) == (5, 209)
    assert np.allclose(m[:, :6], k)
    assert np.allclose(m.sum(axis=1) + 1.0, [_complete(x) for x in k])


def _complete(x: np.ndarray) -> float:
    """Complete homogeneous polynomials up to degree four, by Newton's identities."""
    h = [1.0]
    for degree in range(1, 5):
        h.append(sum(np.sum(x**j) * h[degree - j] for j in range(1, degree + 1)) / degree)
    return sum(h)


def quartic(n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    k = rng.random((n, 6)) * 0.3
    return k, monomials(k) @ np.random.default_rng(7).standard_normal((n_terms(6), 4))


def test_a_quartic_error_is_learned():
    rng = np.random.default_rng(2)
    fitted = KnownError.fitted(*quartic(600, rng), knee=0.15, slope=np.zeros((6, 4)))
    k, truth = quartic(50, rng)
    assert np.abs(fitted(k) - truth).max() < 1e-3 * np.abs(truth).max()


def test_from_few_noisy_runs_nothing_is_made_up():
    """As many runs as monomials and only noise: what is learned is less than the noise."""
    rng = np.random.default_rng(3)
    k = rng.random((n_terms(6), 6)) * 0.3
    fitted = KnownError.fitted(k, rng.standard_normal((len(k), 4)), 0.15, np.zeros((6, 4)))
    assert np.sqrt(np.mean(fitted(rng.random((200, 6)) * 0.3) ** 2)) < 0.5


def test_a_slope_known_beforehand_is_not_drawn_towards_zero():
    """A large linear response from few noisy runs: the ridge takes some of it, unless it is known."""
    rng = np.random.default_rng(4)
    k, slope = rng.random((n_terms(6), 6)) * 0.3, rng.standard_normal((6, 4))
    error = k @ slope + 0.3 * rng.standard_normal((len(k), 4))
    at = 0.1 * np.eye(6)
    drawn, kept = (KnownError.fitted(k, error, 0.15, known)(at) for known in (np.zeros((6, 4)), slope))
    assert np.linalg.norm(kept - at @ slope) < 0.5 * np.linalg.norm(drawn - at @ slope)
