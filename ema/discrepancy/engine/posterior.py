"""Probabilities of sets of causes, never surer than the evidence itself, with their prior."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from .hypothesis import Cause

DRAWS = 4096  # of the evidence's own error
SEED = 20_261_124


@dataclass(frozen=True)
class Entry:
    """One set of causes, its probability and its log evidence with prior [nats] and that one's own error."""

    causes: tuple[str, ...]
    probability: float
    log_evidence: float
    error: float


def log_prior(causes: Iterable[Cause]) -> float:
    """Log prior odds of just these causes against none."""
    return sum(float(np.log(c.prior) - np.log1p(-c.prior)) for c in causes)


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


def p_cause(entries: Sequence[Entry], name: str) -> float:
    """Probability that a cause is there, over all sets."""
    return sum(entry.probability for entry in entries if name in entry.causes)
