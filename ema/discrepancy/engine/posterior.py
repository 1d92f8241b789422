"""Probabilities of sets of causes, never surer than the evidence itself, and the predictive test."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import f, gamma

from .hypothesis import Cause
from .statistic import Prediction

DRAWS = 4096  # of the evidence's own error
SEED = 20_261_124
SHARE = 0.95  # of the probability that a credible set holds
FALSE_ALARMS = 0.004  # of the predictive test


@dataclass(frozen=True)
class Entry:
    """One set of causes, its probability and its log evidence with prior [nats] and that one's own error."""

    causes: tuple[str, ...]
    probability: float
    log_evidence: float
    error: float


def log_prior(names: Iterable[str], causes: Sequence[Cause]) -> float:
    """Log prior probability of just these causes."""
    there = set(names)
    return float(sum(np.log(c.prior) if c.name in there else np.log1p(-c.prior) for c in causes))


def posterior(log_evidence: Mapping[tuple[str, ...], float], error: float) -> list[Entry]:
    """Sets by their probability, the likeliest first.

    What the evidence may be off by is drawn for every set and summed over, so that two sets that differ by less than
    that stay near even.

    Parameters
    ----------
    log_evidence : mapping
        Of each set, with its prior. [nats]
    error : float
        Standard deviation of each. [nats]
    """
    names = list(log_evidence)
    z = np.array([log_evidence[name] for name in names])
    off = error * np.random.default_rng(SEED).standard_normal((DRAWS, len(z))) if error > 0.0 else np.zeros((1, len(z)))
    p = np.exp(z + off - logsumexp(z + off, axis=1, keepdims=True)).mean(axis=0)
    order = np.argsort(-p, kind="stable")
    return [Entry(names[j], float(p[j]), float(z[j]), error) for j in order]


def credible(entries: Sequence[Entry], share: float = SHARE) -> list[Entry]:
    """The likeliest sets that hold `share` of the probability together."""
    total, found = 0.0, []
    for entry in entries:
        found.append(entry)
        total += entry.probability
        if total >= share:
            break
    return found


def p_cause(entries: Sequence[Entry], name: str) -> float:
    """Probability that a cause is there, over all sets."""
    return sum(entry.probability for entry in entries if name in entry.causes)


def predictive(prediction: Prediction, taken: int = 0) -> float:
    """P-value of the record under a hypothesis, by records that nothing was fitted to.

    Of the statistics by Hotelling's T², since their covariance is of few records, and of the rest by a gamma.

    Parameters
    ----------
    taken : int
        How many statistics the fit has taken up.
    """
    C, n = prediction.covariance, prediction.n_records
    chi2 = float(prediction.mean @ np.linalg.solve(C, prediction.mean))
    d = max(len(prediction.mean) - taken, 1)
    of_t = float(f.sf(chi2 * (n - d) / (d * (n - 1.0)), d, n - d))
    scale = prediction.rest_variance / prediction.rest_mean
    rest = float(gamma.sf(prediction.rest, prediction.rest_mean / scale, scale=scale))
    return min(1.0, 2.0 * min(of_t, rest))
