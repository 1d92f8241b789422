from __future__ import annotations

import numpy as np

from ema.reduction.pod import pod


def test_modes_are_those_of_a_full_svd():
    rng = np.random.default_rng(1)
    t = np.linspace(0, 1, 400)
    shapes = np.array([np.sin(np.pi * (j + 1) * t) for j in range(5)])
    X = rng.standard_normal((900, 5)) * [5, 3, 2, 1, 0.5] @ shapes + 0.01 * rng.standard_normal((900, 400))
    i0 = np.cos(t)
    modes = pod(X + i0, i0, r=5)
    _, s, vt = np.linalg.svd(X, full_matrices=False)
    assert np.allclose(modes.lam, s[:5] ** 2, rtol=1e-9)
    assert np.allclose(modes.share, s[:5] ** 2 / np.sum(s**2), rtol=1e-9)
    assert np.allclose(np.abs(np.sum(modes.v * vt[:5].T, axis=0)), 1.0, atol=1e-6)
    assert np.allclose(modes.v.T @ modes.v, np.eye(5), atol=1e-12)


def test_more_modes_than_snapshots_are_not_invented():
    X = np.random.default_rng(2).standard_normal((4, 50))
    modes = pod(X, np.zeros(50), r=10)
    assert len(modes.lam) == 4
    assert np.isclose(modes.share.sum(), 1.0)
