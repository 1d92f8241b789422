"""Evidence against integrals done otherwise, and probabilities against how often they are right."""

from __future__ import annotations

from itertools import chain, combinations, pairwise

import numpy as np
import pytest
from scipy import stats

from ema.discrepancy.engine.evidence import FAULT, WEIGHTS, WIDTHS, evidence, log_box
from ema.discrepancy.engine.law_error import NO_SHARE, SHARES, LawError
from ema.discrepancy.engine.posterior import log_prior, posterior
from ema.discrepancy.engine.statistic import Prediction


def known(mean: np.ndarray) -> Prediction:
    """Noise of unit covariance, and a rest as it should be."""
    return Prediction(mean, np.eye(len(mean)), 10.0, 10.0, 20.0)


def test_one_fault_and_one_size_agree_with_the_integral_done_on_a_grid(toys):
    rng = np.random.default_rng(3)
    fault, size = toys.parameter("k1", low=0.0), toys.parameter("size", high=6.0)
    J, t = rng.standard_normal((5, 2)), 2.0 * rng.standard_normal(5)
    (found,) = evidence([known(-t)], J, np.zeros(2), [fault], [[size]], LawError(5, 0.0, 0.0), NO_SHARE)
    k, u = np.linspace(0.0, 60.0, 1501), np.linspace(-60.0, 6.0, 1501)
    like = np.exp(-0.5 * ((t - J[:, 0] * k[:, None, None] - J[:, 1] * u[:, None]) ** 2).sum(axis=-1))
    like /= (2.0 * np.pi) ** 2.5

    def slab(x, p, low, high):
        parts = [stats.truncnorm(low / (w * p.usual), high / (w * p.usual), scale=w * p.usual).pdf(x) for w in WIDTHS]
        return np.array(WEIGHTS) @ np.array(parts)

    of_u, of_k = slab(u, size, -100.0, 6.0), slab(k, fault, 0.0, 100.0)
    both = np.trapezoid(np.trapezoid(like * of_u, u, axis=1) * of_k, k)
    alone = np.trapezoid(like[0] * of_u, u)
    rest = known(t).log_rest(0.0)
    assert found.log_z - rest == pytest.approx(np.log(FAULT * both + (1.0 - FAULT) * alone), abs=0.03)
    assert found.p_fault[0] == pytest.approx(FAULT * both / (FAULT * both + (1.0 - FAULT) * alone), abs=0.02)


def test_the_box_of_a_correlated_normal():
    rng = np.random.default_rng(5)
    A = rng.standard_normal((3, 3))
    cov, mean = A @ A.T + np.eye(3), np.array([0.5, -1.0, 2.0])
    draws = rng.multivariate_normal(mean, cov, 400_000)
    share = np.mean((draws > 0.0).all(axis=1))
    found = log_box(mean[None], cov[None], np.zeros(3), np.full(3, 1e3))[0]
    assert found == pytest.approx(np.log(share), abs=0.05)


def test_far_in_the_tail_a_box_is_as_small_as_it_is():
    found = log_box(np.array([[-30.0]]), np.ones((1, 1, 1)), np.zeros(1), np.full(1, 1e3))[0]
    assert found == pytest.approx(stats.norm.logsf(30.0), rel=1e-6)


N_TOYS = 2000
BINS = (0.0, 0.5, 0.8, 0.95, 1.0)


def _drawn_toys(toys):
    """Sets of at most two of three causes, two of them alike, beside two faults; what was drawn, and probabilities."""
    rng = np.random.default_rng(20_261_124)
    d, names = 6, ("a", "b", "c")
    plant = toys.plant(2, names)
    sets = list(chain.from_iterable(combinations(names, n) for n in range(3)))
    priors = {s: log_prior(c for c in plant.causes if c.name in s) for s in sets}
    prior = np.exp(list(priors.values()))
    for _ in range(N_TOYS):
        J = dict(zip(("k1", "k2", *names), rng.standard_normal((5, d)), strict=True))
        J["b"] = J["a"] + 0.3 * J["b"]  # look-alikes
        truth = sets[rng.choice(len(sets), p=prior / prior.sum())]
        t = rng.standard_normal(d)
        width = rng.choice(WIDTHS, p=WEIGHTS)
        for f in plant.faults:
            if rng.random() < FAULT:
                t = t + J[f.name] * abs(rng.standard_normal()) * width * f.usual
        for c in (c for c in plant.causes if c.name in truth):
            t = t + J[c.name] * rng.standard_normal() * rng.choice(WIDTHS, p=WEIGHTS) * c.parameters[0].usual
        log_z = {}
        for s in sets:
            columns = np.array([J[name] for name in ("k1", "k2", *s)]).T
            of = [c.parameters for c in plant.causes if c.name in s]
            law = LawError(d, 0.0, 0.0)
            (found,) = evidence([known(-t)], columns, np.zeros(columns.shape[1]), plant.faults, of, law, NO_SHARE)
            log_z[s] = found.log_z + priors[s]
        yield truth, posterior(log_z, 0.0)


@pytest.mark.slow
def test_what_is_said_with_probability_p_is_right_p_of_the_time(toys):
    """The reliability diagram, of every set's probability, where the prior is what was drawn from."""
    said, right = [], []
    for truth, entries in _drawn_toys(toys):
        said += [entry.probability for entry in entries]
        right += [entry.causes == truth for entry in entries]
    p, hit = np.array(said), np.array(right)
    edges = (0.0, 0.02, 0.1, 0.3, *BINS[1:])
    for low, high in pairwise(edges):
        inside = (p > low) & (p <= high)
        n, mean = int(inside.sum()), float(p[inside].mean())
        least, most = stats.binom.interval(0.999, n, mean)  # seven bins
        assert least <= hit[inside].sum() <= most, (low, high, n, mean, hit[inside].mean())


def test_intervals_hold_what_they_say_where_the_law_is_the_librarys_half_of_the_time(toys):
    """And where it is of another form by a share that is drawn as the prior has it."""
    rng = np.random.default_rng(7)
    d, left = 10, 4e4
    law = LawError(d, left, 0.0)
    size = toys.parameter("size", high=60.0)
    z = []
    for share in rng.choice(list(SHARES), size=600, p=list(SHARES.values())):
        J, u = rng.standard_normal((d, 1)), rng.choice(WIDTHS, p=WEIGHTS) * size.usual * rng.standard_normal()
        t = J[:, 0] * u + np.sqrt(1.0 + law.covariance(share)[0, 0]) * rng.standard_normal(d)
        (found,) = evidence([known(-t)], J, np.zeros(1), [], [[size]], law)
        z.append((found.mean[0] - u) / found.sd[0])
    for p, tolerance in ((0.5, 0.065), (0.9, 0.04)):  # three deviations of 600
        assert np.mean(np.abs(z) < stats.norm.isf((1.0 - p) / 2.0)) == pytest.approx(p, abs=tolerance)


def test_no_probability_is_surer_than_the_evidence():
    two = {("a",): 6.0, ("b",): 0.0}
    sure = posterior(two, 0.0)[0].probability
    assert sure == pytest.approx(1.0 / (1.0 + np.exp(-6.0)))
    assert posterior(two, 6.0)[0].probability == pytest.approx(stats.norm.cdf(0.5**0.5), abs=0.02)
    assert posterior(two, 100.0)[0].probability < 0.6


def test_a_rest_smaller_than_records_have_is_no_evidence_against():
    """What honest simulations may differ by is in every simulated record, and need not be in the measured one."""
    less, likeliest, more = (Prediction(np.zeros(1), np.eye(1), rest, 10.0, 20.0) for rest in (4.0, 8.0, 20.0))
    assert less.log_rest(0.0) == pytest.approx(likeliest.log_rest(0.0))
    assert more.log_rest(0.0) < likeliest.log_rest(0.0) - 2.0
    assert more.log_rest(10.0) > more.log_rest(0.0)  # a law of another form may leave it
