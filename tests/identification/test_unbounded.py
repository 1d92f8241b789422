"""Faults of less than none: the distance from the bounds in its own statistics."""

from __future__ import annotations

import numpy as np

from ema.identification import Unbounded
from ema.identification.unbounded import p_possible

SEED = 2611
N = 4000  # draws
rng = np.random.default_rng(SEED)
ROOT = rng.normal(size=(6, 6)) * 0.01
OWN = ROOT @ ROOT.T + 1e-6 * np.eye(6)
NOTHING = np.zeros((6, 6))


def drawn(k, own=OWN, shared=NOTHING, n=1):
    """`n` cycles of one actuator with faults `k`."""
    of_all = rng.multivariate_normal(k, shared)
    return [Unbounded(rng.multivariate_normal(of_all, own), own, shared) for _ in range(n)]


def test_estimates_within_the_bounds_are_possible():
    assert p_possible([Unbounded(np.full(6, 0.1), OWN, NOTHING)]) == 1.0


def test_a_sound_actuator_is_rarely_called_impossible():
    """At no fault at all, the worst case, p below a level is no more frequent than that level."""
    for n, shared in ((1, NOTHING), (5, NOTHING), (5, OWN)):
        p = np.array([p_possible(drawn(np.zeros(6), shared=shared, n=n)) for _ in range(N // n)])
        assert np.mean(p < 0.1) < 0.1 + 3 * np.sqrt(0.09 / len(p))
        assert np.mean(p < 0.01) < 0.01 + 3 * np.sqrt(0.0099 / len(p))


def test_what_one_cycle_does_not_tell_five_do_but_not_where_all_share_the_error():
    less_than_none = np.full(6, 0.5)
    less_than_none[2] = -2.0 * np.sqrt(OWN[2, 2])  # two deviations
    seen = [p_possible(drawn(less_than_none, n=n)) for n in (1, 5) for _ in range(200)]
    assert np.median(seen[:200]) > 1e-2 > 1e-3 > np.median(seen[200:])
    shared = [p_possible(drawn(less_than_none, own=1e-4 * OWN, shared=OWN, n=5)) for _ in range(200)]
    assert np.median(shared) > 1e-2
