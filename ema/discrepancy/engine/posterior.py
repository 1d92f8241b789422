"""Probabilities of sets of causes, never surer than the evidence itself, with their prior."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import logsumexp

from .hypothesis import Array, Cause

DRAWS = 4096  # of the evidence's own error
SEED = 20_261_124
TINY = 1e-300
PRIOR = 0.02  # probability that one given cause is there; some thirty make one likely in every other record


@dataclass(frozen=True)
class Entry:
    """One set of causes, its probability and its log evidence with prior [nats] and that one's own error.

    Where it is known what parts of a record say, the error is that of what it is behind the largest evidence.
    """

    causes: tuple[str, ...]
    probability: float
    log_evidence: float
    error: float


def log_prior(causes: Iterable[Cause]) -> float:
    """Log prior odds of just these causes against none."""
    return sum(log_odds(c.prior) for c in causes)


def log_odds(p: float) -> float:
    """Of a probability against its contrary."""
    return float(np.log(p) - np.log1p(-p))


def posterior(
    log_evidence: Mapping[tuple[str, ...], float],
    error: float = 0.0,
    parts: Mapping[tuple[str, ...], Array] | None = None,
    form: Mapping[str, float] | None = None,
) -> list[Entry]:
    """Sets by their probability, the likeliest first.

    What the evidence may be off by is drawn for every set and summed over, so that two sets that differ by less than
    that stay near even. What the form of a cause's law takes from it is drawn once for all sets that have the cause:
    what two sets share does not part them. The record is drawn too, where it is known what each of its parts adds:
    parts count as often as a Bayesian bootstrap says (Rubin, Ann. Stat. 9, 1981; for predictive scores Yao et al.,
    Bayesian Anal. 13, 2018), so that a set that leads in a few parts and lags in others is no surer than that.

    Parameters
    ----------
    log_evidence : mapping
        Of each set, with its prior. [nats]
    error : float
        Standard deviation of each. [nats]
    form : mapping
        The same of what a cause's law, of another form than the record's, takes from every set that has it. [nats]
    parts : mapping to arrays, shape (n_parts,)
        What each part of the record adds to a set's evidence. [nats]
    """
    names = list(log_evidence)
    z = np.array([log_evidence[name] for name in names])
    rng = np.random.default_rng(SEED)
    off = error * rng.standard_normal((DRAWS, len(z))) if error > 0.0 else np.zeros((1, len(z)))
    own = np.full(len(z), error)
    if form:
        has = np.array([[cause in name for name in names] for cause in form], dtype=float)
        taken = (rng.standard_normal((DRAWS, len(form))) * list(form.values())) @ has
        off = off + taken
        own = np.hypot(own, (taken - taken[:, [np.argmax(z)]]).std(axis=0))
    if parts is not None:
        of_parts = np.array([parts[name] for name in names])
        often = rng.dirichlet(np.ones(of_parts.shape[1]), DRAWS) * of_parts.shape[1]
        off = off + (often - 1.0) @ of_parts.T
        own = (off - off[:, [np.argmax(z)]]).std(axis=0)
    p = np.exp(z + off - logsumexp(z + off, axis=1, keepdims=True)).mean(axis=0)
    order = np.argsort(-p, kind="stable")
    return [Entry(names[j], float(p[j]), float(z[j]), float(own[j])) for j in order]


def p_cause(entries: Sequence[Entry], name: str) -> float:
    """Probability that a cause is there, over all sets."""
    return sum(entry.probability for entry in entries if name in entry.causes)


def thin(entries: Sequence[Entry], share: Mapping[str, float]) -> list[Entry]:
    """The same sets where each cause is there with a `share` only, and else stands for something without a name.

    A cause is then there with its probability times its share. Log evidence becomes that of the probability. [nats]
    """
    p: dict[tuple[str, ...], float] = {}
    most: dict[tuple[str, ...], Entry] = {}
    for entry in entries:
        for there in product((True, False), repeat=len(entry.causes)):
            left = tuple(c for c, is_there in zip(entry.causes, there, strict=True) if is_there)
            weight = [share[c] if is_there else 1.0 - share[c] for c, is_there in zip(entry.causes, there, strict=True)]
            p[left] = p.get(left, 0.0) + entry.probability * float(np.prod(weight))
            most[left] = max(most.get(left, entry), entry, key=lambda e: e.probability)
    order = sorted(p, key=lambda causes: -p[causes])
    return [Entry(causes, p[causes], float(np.log(max(p[causes], TINY))), most[causes].error) for causes in order]
