"""The loop: scan beside the leaders, fit the best few, weigh all by one score, until none is better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .fit import best_of, bounded_step
from .hypothesis import Array, Hypothesis, Parameter, Problem
from .moves import Move, moves
from .posterior import FALSE_ALARMS, Entry, posterior
from .weighing import Budget, Scale, Weighed

BEHIND = 50.0  # [nats] behind the leader, from which a set leads nowhere
LEADERS = 2  # sets whose neighbours are looked into in a round

Say = Callable[[str], None]


@dataclass(frozen=True)
class Answer:
    """What a search found.

    Attributes
    ----------
    posterior : list of Entry
        Sets of causes with probabilities.
    weighed : list of Weighed
        The best of each set, likeliest first.
    p_value : float
        Of the record under the first, by records that nothing was fitted to.
    rejected : list of dict
        What was considered and lost: by how many nats, against which.
    """

    posterior: list[Entry]
    weighed: list[Weighed]
    p_value: float
    rejected: list[dict[str, Any]]

    @property
    def leader(self) -> Weighed:
        """The likeliest set."""
        return self.weighed[0]

    @property
    def is_foretold(self) -> bool:
        """Whether the leader leaves nothing but noise."""
        return self.p_value >= FALSE_ALARMS


def search(problem: Problem, budget: Budget | None = None, say: Say = lambda text: None) -> Answer:
    """Causes of what the simulation gets wrong about a record."""
    return Search(problem, budget or Budget(), say).run()


class Search:
    """The state of a search: the scale of now, and the best hypothesis of each set of causes."""

    def __init__(self, problem: Problem, budget: Budget, say: Say):
        self.problem, self.budget, self.say = problem, budget, say
        self.scale = Scale(problem, budget, {})
        self.found: dict[frozenset[str], Weighed] = {}
        self.lost: dict[frozenset[str], Weighed] = {}

    @property
    def ranked(self) -> list[Weighed]:
        """The best of each set, likeliest first."""
        return sorted(self.found.values(), key=lambda w: -w.log_evidence)

    def run(self) -> Answer:
        """From nothing on."""
        self.look_into(Move("drop", (), {}, ""))
        self.rescale()
        for _ in range(self.budget.rounds):
            leader = self.ranked[0]
            for move in self.promising():
                self.look_into(move)
            if self.ranked[0].hypothesis.key == leader.hypothesis.key:
                break
            self.rescale()
        return self.answer()

    def rescale(self) -> None:
        """All near the leader by the noise and the directions there, since both depend on the point."""
        best = self.ranked[0]
        self.say(f"{best.name} leads")
        self.scale = Scale(self.problem, self.budget, best.hypothesis.point)
        near = {k: w for k, w in self.found.items() if not k or best.log_evidence - w.log_evidence < BEHIND}
        self.lost |= {k: w for k, w in self.found.items() if k not in near}
        null = self.scale.weigh(near.pop(frozenset()).hypothesis)
        self.scale.learn_law_error(null)
        again = [null.hypothesis, *(w.hypothesis for w in near.values())]
        self.found = {h.key: self.scale.weigh(h) for h in again}

    def look_into(self, move: Move) -> None:
        """Fit a set from where a move begins, simulate it, and keep it where it is the best of its set."""
        parameters = self.scale.parameters(move.causes)
        low, high, steps = (np.array([getattr(p, of) for p in parameters]) for of in ("low", "high", "step"))
        known = np.pad(self.scale.scan_columns(parameters), ((0, 1), (0, 0)))
        responses = self.scale.responses(parameters)
        starts = self._starts(move, parameters)
        residuals = self.scale.residuals_from(starts[0], parameters)
        for fit in best_of(residuals, starts, low, high, steps, self.budget.turns, known, responses):
            point = {p.name: float(x) for p, x in zip(parameters, fit.x, strict=True)}
            made = self.scale.weigh(Hypothesis(move.causes, point), fit.columns[: self.scale.d])
            best = self.found.get(move.key)
            if best is None or made.log_evidence > best.log_evidence:
                self.found[move.key] = made
            self.say(f"{move.kind} {made.name}: {made.log_evidence:.5g} nats")

    def _starts(self, move: Move, parameters: tuple[Parameter, ...]) -> list[Array]:
        """Where a move begins, and from there where first order leads."""
        here = np.array([move.start.get(p.name, p.neutral) for p in parameters])
        if not move.causes:
            return [here]
        low, high, steps = (np.array([getattr(p, of) for p in parameters]) for of in ("low", "high", "step"))
        r = self.scale.residuals(parameters)(here[None])[0, : self.scale.d]
        J = self.scale.scan_columns(parameters)
        step, _ = bounded_step(J, r, here, low, high, np.diag(steps), np.inf)
        return [here + step]

    def promising(self) -> list[Move]:
        """Moves from the leaders to the few sets that promise most, by the evidence that first order gives."""
        ranked: list[tuple[float, Move]] = []
        best = self.ranked[0].log_evidence
        for w in [w for w in self.ranked[:LEADERS] if best - w.log_evidence < BEHIND]:
            for move in moves(w.hypothesis, self.problem.causes, self.budget.at_most):
                if move.key not in self.found:
                    ranked.append((self.scale.promise(w, move.causes), move))
        ranked.sort(key=lambda entry: -entry[0])
        sets = list(dict.fromkeys(move.key for _, move in ranked))[: self.budget.width]
        return [move for _, move in ranked if move.key in sets]

    def answer(self) -> Answer:
        """Probabilities, the test, and what was rejected."""
        ranked = self.ranked
        error = float(np.sqrt(np.mean([w.error**2 for w in ranked[:2]])))
        entries = posterior({w.hypothesis.causes: w.log_evidence for w in ranked}, error)
        others = [*ranked[1:], *(w for k, w in self.lost.items() if k not in self.found)]
        rejected = [
            {
                "name": w.name,
                "nats": w.log_evidence - ranked[0].log_evidence,
                "why": f"less likely than {ranked[0].name}",
            }
            for w in sorted(others, key=lambda w: -w.log_evidence)
        ]
        return Answer(entries, ranked, self.scale.p_value(ranked[0]), rejected)
