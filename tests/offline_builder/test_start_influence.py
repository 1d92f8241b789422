"""The start state's influence, made up and recovered."""

from __future__ import annotations

import numpy as np
from ema_offline_builder.noise import start_influence
from ema_offline_builder.runs import START_OFFSET

from ema.identification.noise import N_START, start_features


def test_influence_and_what_it_leaves_are_recovered():
    rng = np.random.default_rng(6)
    n, n_omega = 4000, 3
    s = rng.uniform(-START_OFFSET, START_OFFSET, (n, 2))
    k = rng.uniform(0.0, 0.3, (n, 6)) * (rng.random((n, 1)) < 0.6)
    B = rng.standard_normal((n_omega, N_START))
    S, rest, rest_k = (np.diag(x) for x in ([1e-2, 2e-2, 1e-2], [4e-2, 1e-2, 9e-2], [0.5, 1.0, 0.0]))
    d2 = np.sum((s / START_OFFSET) ** 2, axis=1)
    spread = np.sqrt(np.diag(S) + d2[:, None] * (np.diag(rest) + np.sum(k**2, axis=1)[:, None] * np.diag(rest_k)))
    x = start_features(s / START_OFFSET, k) @ B.T + spread * rng.standard_normal((n, n_omega))
    found_B, found, found_k, scale = start_influence(x, s, k, np.ones(n), S)
    probe = start_features(np.array([0.7, -0.4]), rng.uniform(0.0, 0.3, (50, 6)))
    assert np.allclose(probe @ found_B.T, probe @ B.T, atol=0.1)
    assert np.allclose(np.diag(found), np.diag(rest), atol=0.01)
    assert np.allclose(np.diag(found_k), np.diag(rest_k), atol=0.12)
    assert (scale == START_OFFSET).all()
