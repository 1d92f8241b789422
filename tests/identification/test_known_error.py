from __future__ import annotations

import numpy as np

from ema.identification.known_error import N_TERMS, KnownError, monomials


def test_monomials_are_all_of_degree_one_to_three():
    k = np.random.default_rng(1).random((5, 6))
    m = monomials(k)
    assert m.shape == (5, N_TERMS) == (5, 83)
    assert np.allclose(m[:, :6], k)
    assert np.allclose(m.sum(axis=1) + 1.0, [_complete(x) for x in k])


def _complete(x: np.ndarray) -> float:
    """Complete homogeneous polynomials up to degree three, by Newton's identities."""
    p1, p2, p3 = x.sum(), (x**2).sum(), (x**3).sum()
    return 1 + p1 + (p1**2 + p2) / 2 + (p1**3 + 3 * p1 * p2 + 2 * p3) / 6


def test_a_cubic_error_is_learned():
    rng = np.random.default_rng(2)
    k, c = rng.random((400, 6)) * 0.3, rng.standard_normal((N_TERMS, 4))
    fitted = KnownError.fitted(k, monomials(k) @ c, knee=0.15)
    new = rng.random((50, 6)) * 0.3
    truth = monomials(new) @ c
    assert np.abs(fitted(new) - truth).max() < 1e-3 * np.abs(truth).max()
