"""The scale on which hypotheses are weighed: one whitening, one set of statistics, one law error for all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .evidence import Evidence, evidence
from .hypothesis import Array, Cause, Hypothesis, Parameter, Point, Problem
from .law_error import SHARES, LawError
from .posterior import log_prior, predictive
from .records import Pool, Simulated, seeds, simulated
from .statistic import Prediction, Statistic, Whitening

FIT_SEEDS_FIRST = 1000  # seeds of means while fitting begin here in the pool of columns


@dataclass(frozen=True)
class Budget:
    """How much a search may simulate.

    Attributes
    ----------
    records : int
        Simulated records that whiten, and that a hypothesis is judged by.
    column_seeds, fit_seeds : int
        Seeds of a column, and of a mean while fitting.
    width : int
        Sets that are fitted in a round.
    rounds, at_most : int
        Rounds; causes of a set.
    turns : int
        Of a fit.
    """

    records: int = 96
    column_seeds: int = 8
    fit_seeds: int = 8
    width: int = 4
    rounds: int = 4
    at_most: int = 3
    turns: int = 6


@dataclass(frozen=True)
class Weighed:
    """A hypothesis with what was simulated for it.

    Attributes
    ----------
    columns : array, shape (d, p)
        Of the statistics, per unit of each parameter.
    x : array, shape (p,)
        Faults and parameters where it was fitted, less neutral.
    log_evidence : float
        With the prior of its set. [nats]
    error : float
        Standard deviation of that, as halves of the records tell it. [nats]
    """

    hypothesis: Hypothesis
    parameters: tuple[Parameter, ...]
    prediction: Prediction
    columns: Array
    x: Array
    evidence: Evidence
    log_evidence: float
    error: float

    @property
    def name(self) -> str:
        """The causes in words."""
        return " + ".join(self.hypothesis.causes) or "faults only"


class Scale:
    """Statistics that faults and all candidates can move at one point, and the score of hypotheses by them."""

    def __init__(self, problem: Problem, budget: Budget, point: Point):
        self.problem, self.budget, self.point = problem, budget, dict(point)
        self.known: Mapping[str, Cause] = {cause.name: cause for cause in problem.causes}
        (white,) = simulated(problem, [point], Pool.WHITEN, budget.records)
        self.whitening = Whitening.of(white, problem.blocks, problem.floors)
        everything = [*problem.faults, *(p for c in problem.causes for p in c.parameters)]
        J = self.whitening.white(self._differences(point, everything))
        freedom = (budget.records - problem.grids) * len(problem.blocks)
        self.statistic = Statistic.of(self.whitening, J.T, freedom)
        self.scanned = {p.name: self.statistic.basis.T @ row for p, row in zip(everything, J, strict=True)}
        self.law_error = LawError(np.zeros((self.d, self.d)), 0.0, 0.0)

    @property
    def d(self) -> int:
        """Number of statistics."""
        return self.statistic.basis.shape[1]

    @cached_property
    def span(self) -> Array:
        """Columns of all candidates, (d, n)."""
        return np.array(list(self.scanned.values())).T

    def learn_law_error(self, null: Weighed) -> None:
        """D from what faults alone leave."""
        p = null.prediction
        self.law_error = LawError.of(self.span, -p.mean, p.rest - p.rest_mean)

    def parameters(self, causes: Sequence[str]) -> tuple[Parameter, ...]:
        """Faults, and the parameters of causes."""
        return (*self.problem.faults, *(p for name in causes for p in self.known[name].parameters))

    def columns(self, point: Point, parameters: Sequence[Parameter]) -> Array:
        """Columns of the statistics at a point, (d, n_parameters), per unit."""
        return np.asarray(self.statistic.basis.T @ self.whitening.white(self._differences(point, parameters)).T)

    def scan_columns(self, parameters: Sequence[Parameter]) -> Array:
        """The same at the scale's own point, where they are known."""
        return np.array([self.scanned[p.name] for p in parameters]).T

    def residuals(self, parameters: Sequence[Parameter]) -> Callable[[Array], Array]:
        """Statistics of measured less simulated at points (n, p), and the root of the rest as a last one."""
        of = seeds(Pool.COLUMN, self.budget.fit_seeds, first=FIT_SEEDS_FIRST)
        names = [p.name for p in parameters]

        def at(x: Array) -> Array:
            points = [dict(zip(names, row.tolist(), strict=True)) for row in x]
            t, rest = self.statistic(self.problem.measured - self.problem.records(points, of).mean(axis=1))
            return np.concatenate([t, np.sqrt(rest)[:, None]], axis=1)

        return at

    def residuals_from(self, start: Array, parameters: Sequence[Parameter]) -> Callable[[Array], Array]:
        """The same at points near a start: simulated there, and elsewhere by how points differ, which costs less."""
        here = self.residuals(parameters)(start[None])[0]
        between = self.responses(parameters)
        return lambda x: here - between(start, x)

    def responses(self, parameters: Sequence[Parameter]) -> Callable[[Array, Array], Array]:
        """How the statistics of simulated points (n, p) differ from those of one (p,); of the rest nothing is told."""
        of = seeds(Pool.COLUMN, self.budget.column_seeds)
        names = [p.name for p in parameters]

        def between(at: Array, x: Array) -> Array:
            here, *points = (dict(zip(names, row.tolist(), strict=True)) for row in (at, *x))
            t = self.whitening.white(self.problem.differences(here, points, of)) @ self.statistic.basis
            return np.pad(t, ((0, 0), (0, 1)))

        return between

    def weigh(self, h: Hypothesis, columns: Array | None = None) -> Weighed:
        """Simulate a hypothesis and integrate over all near it."""
        parameters = self.parameters(h.causes)
        if columns is None:
            columns = self.columns(h.point, parameters)
        x = np.array([h.point.get(p.name, p.neutral) - p.neutral for p in parameters])
        (records,) = simulated(self.problem, [h.point], Pool.PREDICT, self.budget.records)
        whole, *halves = (
            Prediction.of(self.statistic, part, self.problem.measured) for part in (records, *_halves(records))
        )
        own = self.integrated(h.causes, whole, columns, x)
        # of halves the mean alone: their covariance is of too few
        moved = [self.integrated(h.causes, replace(whole, mean=half.mean), columns, x).log_z for half in halves]
        error = abs(moved[0] - moved[1]) / 2.0
        return Weighed(h, parameters, whole, columns, x, own, own.log_z + self.prior(h.causes), error)

    def integrated(self, causes: Sequence[str], prediction: Prediction, columns: Array, x: Array) -> Evidence:
        """The evidence of a set of causes, without its prior."""
        of = [self.known[name].parameters for name in causes]
        shares = SHARES if self.law_error.left > 0.0 else SHARES[:1]
        return evidence(prediction, columns, x, self.problem.faults, of, self.law_error, shares)

    def promise(self, w: Weighed, causes: Sequence[str]) -> float:
        """Log evidence of another set of causes, to first order from what was weighed."""
        parameters = self.parameters(causes)
        names = {p.name for p in parameters}
        point = w.hypothesis.point
        gone = [p for p in w.parameters if p.name not in names]
        mean = w.prediction.mean - sum(
            (self.scanned[p.name] * (point[p.name] - p.neutral) for p in gone if p.name in point), np.zeros(self.d)
        )
        at = np.array([point.get(p.name, p.neutral) - p.neutral for p in parameters])
        there = replace(w.prediction, mean=mean)
        return self.integrated(causes, there, self.scan_columns(parameters), at).log_z + self.prior(causes)

    def prior(self, causes: Sequence[str]) -> float:
        """Log prior probability of just these causes."""
        return log_prior(causes, self.problem.causes)

    def p_value(self, w: Weighed) -> float:
        """Of the record under a hypothesis, by records that nothing was fitted to."""
        (fresh,) = simulated(self.problem, [w.hypothesis.point], Pool.TEST, self.budget.records)
        prediction = Prediction.of(self.statistic, fresh, self.problem.measured)
        return predictive(prediction, taken=min(int((np.abs(w.x) > 0.0).sum()), self.d - 1))

    def _differences(self, point: Point, parameters: Sequence[Parameter]) -> Array:
        """Changes of the features per unit of each parameter, (n_parameters, n_features)."""
        at, amounts = [], []
        for p in parameters:
            x = point.get(p.name, p.neutral)
            amounts.append(p.step if p.low <= x + p.step <= p.high else -p.step)
            at.append({**point, p.name: x + amounts[-1]})
        found = self.problem.differences(point, at, seeds(Pool.COLUMN, self.budget.column_seeds))
        return np.asarray(found / np.array(amounts)[:, None])


def _halves(records: Simulated) -> list[Simulated]:
    turn = np.arange(len(records.features)) // records.grids  # each half has records of every grid
    return [Simulated(records.features[turn % 2 == half], records.seeds, records.grids) for half in (0, 1)]
