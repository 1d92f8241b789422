"""Hypotheses that a search has fitted, weighed on one scale: probabilities of sets of causes, and sizes.

What separates them are the directions in which they move a record and those in which they differ. These directions
are the statistics, the same for all; so are whitening and law error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .evidence import Evidence, evidence
from .hypothesis import Array, Cause, Parameter, Point, Problem
from .law_error import SHARES, LawError
from .posterior import Entry, posterior
from .records import Pool, Simulated, simulated
from .statistic import Prediction, Statistic, Whitening

Say = Callable[[str], None]
BEHIND = 30.0  # [nats] behind the leader, from which a set is not looked at more closely
TURNS = 2  # in which those near the leader are simulated anew where their evidence says


@dataclass(frozen=True)
class Entrant:
    """A fitted hypothesis.

    Attributes
    ----------
    causes : tuple of Causes
        None for the null hypothesis, faults alone.
    point : Point
        Where it was fitted.
    columns : array, shape (n_features, n_faults + n_parameters)
        Of the features, per unit of faults and parameters, there.
    """

    causes: tuple[Cause, ...]
    point: Point
    columns: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the causes."""
        return tuple(c.name for c in self.causes)


@dataclass(frozen=True)
class Weighed:
    """An entrant with its evidence, prior included, and that one's own error. [nats]"""

    entrant: Entrant
    parameters: tuple[Parameter, ...]
    prediction: Prediction
    evidence: Evidence
    log_evidence: float
    error: float

    @property
    def point(self) -> dict[str, float]:
        """Expected values of faults and parameters."""
        return {p.name: p.neutral + float(u) for p, u in zip(self.parameters, self.evidence.mean, strict=True)}


@dataclass(frozen=True)
class Outcome:
    """Sets of causes with probabilities, and the best hypothesis of each set, likeliest first."""

    posterior: list[Entry]
    weighed: list[Weighed]


class Contest:
    """One whitening, one set of statistics and one law error for entrants, the first of which is the null hypothesis.

    Parameters
    ----------
    entrants : sequence of Entrants
        The first is faults alone.
    whitening : Whitening
        By the noise near what explains the record best.
    n_records : int
        Simulated records of each entrant.
    """

    def __init__(
        self, problem: Problem, entrants: Sequence[Entrant], whitening: Whitening, n_records: int, say: Say
    ) -> None:
        self.problem, self.whitening, self.n, self.say = problem, whitening, n_records, say
        moved = np.concatenate([e.columns.T for e in entrants])
        null, *others = (
            r.features.mean(axis=0) for r in simulated(problem, [e.point for e in entrants], Pool.COLUMN, problem.grids)
        )
        directions = self.whitening.white(np.array([*moved, *(x - null for x in others)]))
        freedom = (n_records - problem.grids) * len(problem.blocks)
        self.statistic = Statistic.of(self.whitening, directions.T, freedom)
        self.law_error = LawError(np.zeros((self.d, self.d)), 0.0, 0.0)
        left = self.weigh(entrants[0]).prediction
        self.law_error = LawError.of(np.eye(self.d), -left.mean, left.rest - left.rest_mean)

    @property
    def d(self) -> int:
        """Number of statistics."""
        return self.statistic.basis.shape[1]

    def weigh(self, entrant: Entrant) -> Weighed:
        """Simulate an entrant and integrate over all near it."""
        (records,) = simulated(self.problem, [entrant.point], Pool.PREDICT, self.n)
        parameters = (*self.problem.faults, *(p for c in entrant.causes for p in c.parameters))
        J = self.statistic.basis.T @ self.whitening.white(entrant.columns.T).T
        x = np.array([entrant.point.get(p.name, p.neutral) - p.neutral for p in parameters])
        whole, *halves = (
            Prediction.of(self.statistic, part, self.problem.measured) for part in (records, *_halves(records))
        )
        shares = SHARES if self.law_error.left > 0.0 else SHARES[:1]

        def of(prediction: Prediction) -> Evidence:
            causes = [c.parameters for c in entrant.causes]
            return evidence(prediction, J, x, self.problem.faults, causes, self.law_error, shares)

        own = of(whole)
        # of halves the mean alone: their covariance is of too few
        moved = [of(replace(whole, mean=half.mean, rest=half.rest)).log_z for half in halves]
        prior = sum(float(np.log(c.prior) - np.log1p(-c.prior)) for c in entrant.causes)
        return Weighed(entrant, parameters, whole, own, own.log_z + prior, abs(moved[0] - moved[1]) / 2.0)

    def run(self, entrants: Sequence[Entrant]) -> Outcome:
        """All weighed; those near the leader anew where their evidence says they are, as long as that gains."""
        found = [self.weigh(e) for e in entrants]
        for _ in range(TURNS):
            top = max(w.log_evidence for w in found)
            for j, w in enumerate(found):
                if top - w.log_evidence < BEHIND:
                    moved = self.weigh(replace(w.entrant, point={**w.entrant.point, **w.point}))
                    self.say(
                        f"{' + '.join(w.entrant.names) or 'faults only'}: {moved.log_evidence - w.log_evidence:+.1f}"
                    )
                    found[j] = max(w, moved, key=lambda x: x.log_evidence)
        best: dict[tuple[str, ...], Weighed] = {}
        for w in sorted(found, key=lambda w: -w.log_evidence):
            best.setdefault(tuple(sorted(w.entrant.names)), w)
        ranked = list(best.values())
        error = float(np.sqrt(np.mean([w.error**2 for w in ranked[:2]])))
        return Outcome(posterior({w.entrant.names: w.log_evidence for w in ranked}, error), ranked)


def _halves(records: Simulated) -> list[Simulated]:
    turn = np.arange(len(records.features)) // records.grids  # each half has records of every grid
    return [Simulated(records.features[turn % 2 == half], records.seeds, records.grids) for half in (0, 1)]
