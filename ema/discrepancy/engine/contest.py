"""Hypotheses that a search has fitted, weighed on one scale: probabilities of sets of causes, and sizes.

What separates them are the directions in which they move a record and those in which they differ. These directions
are the statistics, the same for all; so are whitening and law error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from .evidence import Evidence, evidence
from .hypothesis import Array, Cause, Parameter, Point, Problem
from .law_error import NO_SHARE, SHARES, LawError
from .posterior import Entry, log_prior, posterior
from .records import Pool, Simulated, simulate
from .secants import learn_from
from .statistic import Prediction, Statistic, Whitening

Say = Callable[[str], None]
BEHIND = 30.0  # [nats] behind the leader, from which a set is not looked at more closely
TURNS = 2  # in which one is simulated anew where its evidence says it is
OUTSIDE = 0.01  # probability of a step that noise makes, from which it is simulated there
EXPANSIONS = 3  # points by which a set near the leader is weighed


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

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of their parameters."""
        return tuple(p.name for c in self.causes for p in c.parameters)


@dataclass(frozen=True)
class Weighed:
    """An entrant with its evidence, prior included, and that one's own error. [nats]

    `predictions` are by all records and by either half of them, `columns` those of the statistics, shape (d, n_faults +
    n_parameters). `felt` is the squared step from where it was simulated to where its evidence says it is, in
    deviations of a record.
    """

    entrant: Entrant
    parameters: tuple[Parameter, ...]
    predictions: tuple[Prediction, ...]
    columns: Array
    evidence: Evidence
    log_evidence: float
    error: float
    felt: float

    @property
    def at(self) -> Array:
        """Where it was simulated, shape (n_faults + n_parameters,)."""
        return np.array([self.entrant.point.get(p.name, p.neutral) for p in self.parameters])

    @property
    def name(self) -> str:
        """The causes in words."""
        return " + ".join(self.entrant.names) or "faults only"

    @property
    def point(self) -> dict[str, float]:
        """Expected values of faults and parameters."""
        return {p.name: p.neutral + float(u) for p, u in zip(self.parameters, self.evidence.mean, strict=True)}

    @property
    def sd(self) -> dict[str, float]:
        """Their standard deviations."""
        return {p.name: float(s) for p, s in zip(self.parameters, self.evidence.sd, strict=True)}


@dataclass(frozen=True)
class Outcome:
    """Sets of causes with probabilities, and the best hypothesis of each set, likeliest first."""

    posterior: list[Entry]
    weighed: list[Weighed]

    def sizes(self, cause: str) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of each parameter of a cause, given that it is there, over all sets with it.

        KeyError where no set has it.
        """
        having = [w for w in self.weighed if cause in w.entrant.names]
        if not having:
            raise KeyError(cause)
        names = (q.name for w in having for c in w.entrant.causes if c.name == cause for q in c.parameters)
        return {name: self._size(name, having) for name in dict.fromkeys(names)}

    def sizes_of_faults(self, faults: Iterable[str]) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of each fault over all sets: where one is less with a cause, it may be more."""
        return {name: self._size(name, self.weighed) for name in faults}

    def _size(self, name: str, having: Sequence[Weighed]) -> tuple[float, float]:
        p = {entry.causes: entry.probability for entry in self.posterior}
        free = [w for w in having if name in w.point]
        weight = np.array([p[w.entrant.names] for w in free])
        weight = weight / weight.sum() if weight.sum() > 0.0 else np.eye(len(free))[0]
        mean, sd = np.array([(w.point[name], w.sd[name]) for w in free]).T
        expected = float(weight @ mean)
        return expected, float(np.sqrt(weight @ (sd**2 + (mean - expected) ** 2)))


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
            r.features.mean(axis=0) for r in simulate(problem, [e.point for e in entrants], Pool.COLUMN, problem.grids)
        )
        directions = self.whitening.white(np.array([*moved, *(x - null for x in others)]))
        freedom = (n_records - problem.grids) * len(problem.blocks)
        self.statistic = Statistic.of(self.whitening, directions.T, freedom)
        self.law_error = LawError(self.d, 0.0, 0.0)
        left = self.weigh(entrants[:1])[0].predictions[0]
        self.law_error = LawError.of(left.mean, left.rest - left.rest_mean)

    @property
    def d(self) -> int:
        """Number of statistics."""
        return self.statistic.basis.shape[1]

    def weigh(self, entrants: Sequence[Entrant]) -> list[Weighed]:
        """Simulate entrants, all at once, and integrate over all near each."""
        records = simulate(self.problem, [e.point for e in entrants], Pool.PREDICT, self.n)
        return [self._weighed(e, r) for e, r in zip(entrants, records, strict=True)]

    def _weighed(self, entrant: Entrant, records: Simulated) -> Weighed:
        J = self.statistic.basis.T @ self.whitening.white(entrant.columns.T).T
        parts = (records, *_halves(records))
        predictions = (Prediction.of(self.statistic, part, self.problem.measured) for part in parts)
        return self._integrated(entrant, tuple(predictions), J)

    def _integrated(self, entrant: Entrant, predictions: tuple[Prediction, ...], J: Array) -> Weighed:
        parameters = (*self.problem.faults, *(p for c in entrant.causes for p in c.parameters))
        x = np.array([entrant.point.get(p.name, p.neutral) - p.neutral for p in parameters])
        shares = SHARES if self.law_error.left > 0.0 else NO_SHARE
        whole, *halves = predictions
        # of halves the mean alone: their covariance is of too few
        of = [whole, *(replace(whole, mean=half.mean, rest=half.rest) for half in halves)]
        causes = [c.parameters for c in entrant.causes]
        own, *moved = evidence(of, J, x, self.problem.faults, causes, self.law_error, shares)
        step = J @ (own.mean - x)
        felt = float(step @ np.linalg.solve(whole.covariance, step))
        error = abs(moved[0].log_z - moved[1].log_z) / 2.0
        return Weighed(entrant, parameters, predictions, J, own, own.log_z + log_prior(entrant.causes), error, felt)

    def run(self, entrants: Sequence[Entrant]) -> Outcome:
        """All sets of causes weighed, by the first entrant of each; those near the leader by their other ones too.

        Of causes that may act in several ways, by other parameters, each way is weighed, and the likeliest stands.
        """
        ways: dict[tuple[tuple[str, ...], frozenset[str]], list[Entrant]] = {}
        for e in entrants:
            ways.setdefault((tuple(sorted(e.names)), frozenset(e.parameters)), []).append(e)
        found = dict(zip(ways, self.weigh([of[0] for of in ways.values()]), strict=True))
        top = max(w.log_evidence for w in found.values())
        for way, of in ways.items():
            if top - found[way].log_evidence < BEHIND:
                alike = [e for e in of[1:] if e.parameters == of[0].parameters][: EXPANSIONS - 1]
                found[way] = average(self.explored([found[way], *self.weigh(alike)]))
        sets = {names: w for (names, _), w in sorted(found.items(), key=lambda item: item[1].log_evidence)}
        ranked = sorted(sets.values(), key=lambda w: -w.log_evidence)
        error = float(np.sqrt(np.mean([w.error**2 for w in ranked[:2]])))
        return Outcome(posterior({w.entrant.names: w.log_evidence for w in ranked}, error), ranked)

    def explored(self, seen: Sequence[Weighed]) -> list[Weighed]:
        """Points of one set of causes, by columns that agree with all of them.

        The likeliest is simulated anew where its own evidence says it is, where that is not near.
        """
        seen = self._agreeing(seen)
        for _ in range(TURNS):
            w = max(seen, key=lambda w: w.log_evidence)
            if w.felt < float(chi2.isf(OUTSIDE, len(w.parameters))):
                break
            (moved,) = self.weigh([replace(w.entrant, point={**w.entrant.point, **w.point})])
            self.say(f"{w.name}, simulated anew: {moved.log_evidence - w.log_evidence:+.1f} nats")
            seen = self._agreeing([*seen, self._integrated(moved.entrant, moved.predictions, w.columns)])
        return seen

    def _agreeing(self, seen: Sequence[Weighed]) -> list[Weighed]:
        points = np.array([w.at for w in seen])
        means = np.array([[w.predictions[half].mean for w in seen] for half in (1, 2)])
        learned = [learn_from(w.columns, points, means) for w in seen]
        return [
            w if np.array_equal(J, w.columns) else self._integrated(w.entrant, w.predictions, J)
            for w, J in zip(seen, learned, strict=True)
        ]


def average(found: Sequence[Weighed]) -> Weighed:
    """One set of causes by several points about which its response was taken for linear.

    Each gives an estimate of one and the same integral: these are averaged, and sizes are those of the mixture. Where
    the points disagree by more than noise, the response is not linear, and interval and error grow by that.
    """
    log_z = np.array([w.log_evidence for w in found])
    weight = np.exp(log_z - logsumexp(log_z))
    mean = weight @ np.array([w.evidence.mean for w in found])
    second = weight @ np.array([w.evidence.sd**2 + w.evidence.mean**2 for w in found])
    sd = np.sqrt(np.maximum(second - mean**2, 0.0))
    best = found[int(np.argmax(log_z))]
    total = float(logsumexp(log_z)) - float(np.log(len(found)))
    of_all = Evidence(
        total + best.evidence.log_z - best.log_evidence,
        weight @ np.array([w.evidence.p_fault for w in found]),
        mean,
        sd,
    )
    between = float(weight @ (log_z - weight @ log_z) ** 2)
    return replace(best, evidence=of_all, log_evidence=total, error=float(np.hypot(best.error, np.sqrt(between))))


def _halves(records: Simulated) -> list[Simulated]:
    turn = np.arange(len(records.features)) // records.grids  # each half has records of every grid
    return [Simulated(records.features[turn % 2 == half], records.seeds, records.grids) for half in (0, 1)]
