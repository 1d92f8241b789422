"""How long until a fault reaches a threshold, from the trend of its estimates; silent where the trend says nothing.

A fault is healthy, then grows, and may change its rate:

    k(t) = a + b t + c φ(t) + √q W(t)

φ is zero until t_0 and then one of: linear, accelerating or settling, φ = (exp(g s) − 1) / g with s = t − t_0, or
running away, φ = s / (1 − s/τ). Damage does not heal: paths that would are left out. W is a Wiener process: real damage
does not follow a smooth law. Given t_0, the law and q the model is linear, and a, b, c and the scale of the noise are
integrated out in closed form (normal-inverse-gamma prior); t_0, law and q are summed over a grid with the evidence as
weight, so that what the data cannot decide widens the interval. Paths are drawn from that posterior and continued; the
time at which a path crosses the threshold is one draw of the remaining life. A law seen for a time T is trusted for a
like time: the remaining life r of every path is multiplied by exp(v √(r/T) z), z standard normal. v is the one number
set by calibration on simulated histories (`benchmarks/prognosis.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

LEVELS = (0.05, 0.5, 0.95)
MIN_POINTS = 8
_N_DRAWS = 2000
_N_BINS = 100
_SPREAD = 0.15  # v
_MIN_GROWTH = 5.0  # change of the trend over the history, in its standard deviations
_FARTHEST = 4.0  # remaining life told at most, in lengths of the growth seen
_LATEST = 8.0  # a later end of the interval, in lengths of the history, is a growth that may be settling
_ONSETS = np.linspace(-0.05, 0.9, 20)  # t_0 in lengths of the history
_RATES = (-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0)  # g times the length of the history
_RUNAWAY = (0.3, 0.5, 0.65, 0.8, 0.9)  # s/τ today
_ROUGHNESS = (0.0, 0.01, 0.03, 0.09, 0.2)  # √q over the history, in thresholds
_PRIOR_SHAPE = 2.0  # inverse-gamma prior of the noise scale squared, mean 1: the estimates' sd are roughly right
_AHEAD = np.geomspace(1e-3, 40.0, 200)  # times at which paths are looked at, in lengths of the history


class Trend(NamedTuple):
    """Estimates of one fault in the order of time: arrays of shape (n,); t [s]."""

    t: np.ndarray
    k: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class Prognosis:
    """Remaining life of one fault until a threshold, or why none is told.

    Attributes
    ----------
    silent : str
        Reason for telling nothing; empty when there is a prognosis.
    life : array, shape (3,)
        Quantiles 5, 50 and 95 % of the time from the last estimate to the crossing; NaN when silent. [s]
    draws : array, shape (n,)
        Draws of the remaining life, infinite for paths that do not cross. [s]
    """

    silent: str
    life: np.ndarray
    draws: np.ndarray


def prognosis(trend: Trend, threshold: float, rng: np.random.Generator) -> Prognosis:
    """Remaining life until `threshold`; estimates that are NaN are left out."""
    seen = np.isfinite(trend.k) & np.isfinite(trend.sd) & (trend.sd > 0)
    if seen.sum() < MIN_POINTS:
        return _silence(f"fewer than {MIN_POINTS} estimates")
    t, k, sd = _binned(trend.t[seen], trend.k[seen], trend.sd[seen])
    span = t[-1] - t[0]
    if span <= 0:
        return _silence("all estimates are of one time")
    paths = _posterior((t - t[0]) / span, k, sd, threshold, rng)
    if paths is None:
        return _silence("no growth that stands out of the noise")
    if np.median(paths.ahead(np.zeros(1), rng)) >= threshold:
        return _silence("the threshold is reached already")
    grown = 1.0 - np.clip(paths.onset, 0.0, 0.98)
    life = _crossing(paths, threshold, rng)
    far = np.minimum(life, _AHEAD[-1])
    life = life * np.exp(_SPREAD * np.sqrt(far / grown) * rng.standard_normal(len(life)))
    quantiles = np.quantile(life, LEVELS, method="inverted_cdf")
    if not quantiles[1] <= _FARTHEST * np.median(grown):
        return _silence(f"farther away than {_FARTHEST:g} times the growth seen")
    if not quantiles[2] <= _LATEST:
        return _silence("the growth may end before the threshold")
    return Prognosis("", quantiles * span, life * span)


class _Law(NamedTuple):
    """Shape of the growth after its onset: accelerating by `rate`, or running away with `share` = s/τ today."""

    rate: np.ndarray
    share: np.ndarray

    def growth(self, t: np.ndarray, onset: np.ndarray) -> np.ndarray:
        """φ; all arguments broadcast."""
        since = np.maximum(t - onset, 0.0)
        rate = np.where(self.rate == 0.0, 1.0, self.rate)
        smooth = np.where(self.rate == 0.0, since, np.expm1(np.minimum(rate * since, 300.0)) / rate)
        left = 1.0 - self.share * since / (1.0 - onset)
        return np.where(self.share == 0.0, smooth, np.where(left > 1e-6, since / np.maximum(left, 1e-6), 1e6))

    def at(self, index: np.ndarray) -> _Law:
        return _Law(self.rate[index], self.share[index])

    def column(self) -> _Law:
        return _Law(self.rate[:, None], self.share[:, None])


@dataclass(frozen=True)
class _Paths:
    """Draws from the posterior, each array of shape (n,); times in lengths of the history."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    onset: np.ndarray
    law: _Law
    roughness: np.ndarray  # √q
    wandered: np.ndarray  # √q W now

    def ahead(self, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """k at times from now, ascending, shape (n, len(times))."""
        t = 1.0 + times[None, :]
        phi = self.law.column().growth(t, self.onset[:, None])
        steps = rng.standard_normal((len(self.a), len(times))) * np.sqrt(np.diff(times, prepend=0.0))
        walk = self.wandered[:, None] + self.roughness[:, None] * np.cumsum(steps, axis=1)
        return self.a[:, None] + self.b[:, None] * t + self.c[:, None] * phi + walk


def _posterior(
    t: np.ndarray, k: np.ndarray, sd: np.ndarray, threshold: float, rng: np.random.Generator
) -> _Paths | None:
    """Paths of a growing fault; None when growth does not stand out of the noise."""
    rates = np.array([*_RATES, *([0.0] * len(_RUNAWAY))])
    shares = np.array([*([0.0] * len(_RATES)), *_RUNAWAY])
    onset, which = (grid.ravel() for grid in np.meshgrid(_ONSETS, np.arange(len(rates)), indexing="ij"))
    law = _Law(rates, shares).at(which)
    phi = law.column().growth(t[None, :], onset[:, None])
    today = law.growth(np.array(1.0), onset)
    X = np.stack([np.ones_like(phi), np.broadcast_to(t, phi.shape), phi / today[:, None]], axis=-1)
    prior = np.diag(1.0 / np.array([1.0, threshold, threshold]) ** 2)
    fits = [_fit(X, k, sd, t, threshold * rough, prior) for rough in _ROUGHNESS]
    evidence = np.stack([fit.evidence for fit in fits])
    weight = np.exp(evidence - evidence.max()).ravel()
    chosen = rng.choice(weight.size, 4 * _N_DRAWS, p=weight / weight.sum())
    rough, node = np.divmod(chosen, len(onset))
    beta = np.empty((chosen.size, 3))
    wandered = np.zeros(chosen.size)
    for index, fit in enumerate(fits):
        own = np.flatnonzero(rough == index)
        beta[own], wandered[own] = fit.draw(node[own], X, k, rng)
    a, b, c = beta.T
    change = b + c + wandered
    if change.mean() < _MIN_GROWTH * change.std():
        return None
    c = c / today[node]
    bent = (law.rate[node] > 0.0) | (law.share[node] > 0.0)  # a negative c would bend the path down for good
    slope = b + c * np.where(bent, 0.0, np.exp(law.rate[node] * (1.0 - onset[node])))
    keep = np.flatnonzero((b >= -0.02 * threshold) & np.where(bent, c >= 0.0, slope > 0.0))[:_N_DRAWS]
    if len(keep) < 100:
        return None
    node, q = node[keep], threshold * np.array(_ROUGHNESS)[rough[keep]]
    return _Paths(a[keep], np.maximum(b[keep], 0.0), c[keep], onset[node], law.at(node), q, wandered[keep])


@dataclass(frozen=True)
class _Fit:
    """Closed-form fits of all nodes for one roughness."""

    mean: np.ndarray
    root: np.ndarray
    shape: float
    scale: np.ndarray
    evidence: np.ndarray
    gain: np.ndarray  # of √q W(1) on the residual
    left: float  # variance of √q W(1) that the data leave

    def draw(
        self, node: np.ndarray, X: np.ndarray, k: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """(a, b, c) and √q W(1) of paths, one for each entry of `node`."""
        noise = np.sqrt(self.scale[node] / rng.gamma(self.shape, size=len(node)))
        spread = np.einsum("nij,nj->ni", self.root[node], rng.standard_normal((len(node), 3)))
        beta = self.mean[node] + noise[:, None] * spread
        residual = k - np.einsum("nti,ni->nt", X[node], beta)
        wandered = residual @ self.gain + noise * np.sqrt(self.left) * rng.standard_normal(len(node))
        return beta, wandered


def _fit(X: np.ndarray, k: np.ndarray, sd: np.ndarray, t: np.ndarray, rough: float, prior: np.ndarray) -> _Fit:
    walk = rough**2 * np.minimum(t[:, None], t[None, :])
    covariance = np.diag(sd**2) + walk
    lower = np.linalg.cholesky(covariance)
    inverse = np.linalg.inv(lower)
    Xw, yw = np.einsum("ts,msi->mti", inverse, X), inverse @ k
    precision = np.einsum("mti,mtj->mij", Xw, Xw) + prior
    posterior = np.linalg.inv(precision)
    mean = np.einsum("mij,mj->mi", posterior, np.einsum("mti,t->mi", Xw, yw))
    shape = _PRIOR_SHAPE + len(k) / 2
    square = np.maximum(yw @ yw - np.einsum("mi,mij,mj->m", mean, precision, mean), 1e-9)
    scale = _PRIOR_SHAPE - 1.0 + square / 2
    evidence = -0.5 * np.linalg.slogdet(precision)[1] - shape * np.log(scale) - np.log(np.diag(lower)).sum()
    to_now = rough**2 * t  # covariance of √q W(1) with √q W(t)
    gain = np.linalg.solve(covariance, to_now)
    return _Fit(
        mean, np.linalg.cholesky(posterior), shape, scale, evidence, gain, max(0.0, float(rough**2 - gain @ to_now))
    )


def _crossing(paths: _Paths, threshold: float, rng: np.random.Generator) -> np.ndarray:
    """Time from now at which each path first reaches the threshold, infinite without one, in lengths of the history."""
    k = paths.ahead(_AHEAD, rng)
    above = k >= threshold
    first = above.argmax(axis=1)
    row = np.arange(len(first))
    before = np.maximum(first - 1, 0)
    low, high = k[row, before], k[row, first]
    share = np.where(first > 0, (threshold - low) / np.maximum(high - low, 1e-12), 0.0)
    life = _AHEAD[before] + share * (_AHEAD[first] - _AHEAD[before])
    return np.where(above.any(axis=1), life, np.inf)


def _binned(t: np.ndarray, k: np.ndarray, sd: np.ndarray) -> Trend:
    """At most _N_BINS points: means weighted by 1/sd² over equal counts."""
    if len(t) <= _N_BINS:
        return Trend(t, k, sd)
    edges = np.linspace(0, len(t), _N_BINS + 1).astype(int)[:-1]
    weight = 1.0 / sd**2
    total = np.add.reduceat(weight, edges)
    t_mean, k_mean = (np.add.reduceat(weight * x, edges) / total for x in (t, k))
    return Trend(t_mean, k_mean, 1.0 / np.sqrt(total))


def _silence(reason: str) -> Prognosis:
    return Prognosis(reason, np.full(len(LEVELS), np.nan), np.zeros(0))
