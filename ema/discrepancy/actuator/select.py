"""Which effects explain the cycles of an actuator: screen all linearly, fit the best, judge on held-out cycles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ema.core.names import FAULTS

from .candidates import Candidate, candidates
from .features import Array
from .fit import (
    K_FREE,
    N_SEEDS,
    SEED,
    Columns,
    Fit,
    Free,
    bounded,
    bounds,
    fit,
    moved,
    residuals,
    stacked_jacobian,
)
from .noise import Noise, Verdict, verdict
from .plant import EmaPlant, Point
from .weak import Torque, torque

N_FINAL = 24  # seeds of a mean that is judged
FINAL_SEED = 3_000_000
N_PROBE = 8  # seeds of a column that only screens
N_REFINED = 4
WORTH_A_FIT = 0.9  # share of the squared residual a candidate may leave, to first order
N_REFINED_AT_LEAST = 2
FEW_FAULTS, K_LARGE = (0.3, 3.0), 0.1  # a fault of 0.1 weighs like these shares of the residual
MAX_EFFECTS = 3

Say = Callable[[str], None]


@dataclass
class Model:
    """A fitted model and how it does on held-out cycles.

    `heldout` is the sum of squares over what noise makes of it: one where nothing is left to explain.
    """

    effects: tuple[Candidate, ...]
    fit: Fit
    heldout: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(c.effect for c in self.effects)

    @property
    def excess(self) -> float:
        """What is left on held-out cycles beyond noise."""
        return max(self.heldout - 1.0, 0.0)


@dataclass
class Search:
    """The state of a search: everything that was tried, in order."""

    plant: EmaPlant
    noise: Noise
    train: list[int]
    heldout: list[int]
    say: Say = lambda text: None
    columns: dict[tuple[int, str], Array] = field(default_factory=dict)
    tried: list[Model] = field(default_factory=list)

    def model(
        self,
        effects: Sequence[Candidate],
        frees: Sequence[Free],
        start: Point,
        known: Columns | None,
        n_iterations: int,
    ) -> Model:
        """Fit on training cycles, judge on held-out ones."""
        fitted = fit(self.plant, self.noise, frees, start, self.train, known=known, n_iterations=n_iterations)
        left = residuals(self.plant, self.noise, fitted.point, self.heldout, N_FINAL, FINAL_SEED)
        made = Model(tuple(effects), fitted, self.noise.misfit(list(left.values()), self.heldout))
        self.tried.append(made)
        self.say(f"{' + '.join(made.names) or 'faults only'}: held-out misfit {made.heldout:.3g}")
        return made

    def verdict(self, model: Model) -> Verdict:
        """Is what `model` leaves on all cycles noise?"""
        cycles = sorted(self.train + self.heldout)
        left = residuals(self.plant, self.noise, model.fit.point, cycles, N_FINAL, FINAL_SEED)
        cols = [
            self.noise.motions[m].white(np.array([model.fit.columns[m, f.name] for f in model.fit.free])).T
            for m in range(self.plant.n_motions)
        ]
        return verdict(self.noise, [left[c] for c in cycles], cycles, cols, 1.0 / N_FINAL)

    def torques(self, model: Model) -> list[Torque]:
        """What `model` leaves of the torque balance, by training cycle. [N m]"""
        plant = self.plant
        found = []
        for c in self.train:
            motion = int(plant.data.motion[c])
            at = plant.slices[motion]["torque"]
            r = plant.data.y[c] - plant.mean([model.fit.point], c, N_SEEDS, SEED)[0]
            sd = self.noise.of(c).sd
            found.append(torque(plant.data.signals[c], r[at], sd[at], plant.plant.control.rate))
        return found

    def probe(self, found: Sequence[Candidate]) -> None:
        """Fill in the columns (per unit) of candidates that were not probed before."""
        new = [c for c in found if (0, c.key + "/0") not in self.columns]
        points = [p for c in new for p in c.probes()]
        for motion in range(self.plant.n_motions if new else 0):
            means = self.plant.mean([{}, *points], self.plant.first[motion], N_PROBE, SEED)
            rows = iter(means[1:] - means[0])
            for c in new:
                for j, amount in enumerate(c.amounts):
                    self.columns[motion, f"{c.key}/{j}"] = next(rows) / amount

    def screen(self, model: Model, found: Sequence[Candidate]) -> list[Screened]:
        """What each candidate promises to first order next to all that `model` has free, best first."""
        self.probe(found)
        f = model.fit
        own = stacked_jacobian(self.noise, f.free, f.columns, self.train)
        r = np.concatenate([f.residuals[c] for c in self.train])
        low, high = bounds(f.free, f.point)
        faults = [j for j, p in enumerate(f.free) if p.name in FAULTS]
        k = np.array([f.point.get(f.free[j].name, 0.0) for j in faults])
        ranked = []
        for c in found:
            names = [Free(f"{c.key}/{j}", 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
            J = np.concatenate([own, stacked_jacobian(self.noise, names, self.columns, self.train)], axis=1)
            c_low, c_high = c.limits()
            limits = np.concatenate([low, c_low]), np.concatenate([high, c_high])
            step, promised = bounded(J, r, *limits)
            steps = [step]
            # the same with faults held small: where effect and faults can stand for each other, noise in the columns
            # would leave the faults where they are
            for share in FEW_FAULTS:
                weight = np.sqrt(share * (promised + len(r))) / K_LARGE
                prior = np.zeros((len(faults), J.shape[1]))
                prior[np.arange(len(faults)), faults] = weight
                steps.append(bounded(np.concatenate([J, prior]), np.concatenate([r, -weight * k]), *limits)[0])
            starts = [{**moved(f.point, f.free, step[: len(f.free)]), **c.start(step[len(f.free) :])} for step in steps]
            ranked.append(Screened(promised, c, starts))
        return sorted(ranked, key=lambda entry: entry.promised)

    def extend(self, model: Model) -> list[Model]:
        """The best models with one more effect, best first."""
        found = [c for c in candidates(self.plant.data, self.torques(model)) if c.effect not in model.names]
        refined: dict[str, Model] = {}
        cost = sum(float(r @ r) for r in model.fit.residuals.values())
        for promised, c, starts in self.screen(model, found):
            if refined and promised > WORTH_A_FIT * cost:
                break
            if len(refined) >= N_REFINED or (len(refined) >= N_REFINED_AT_LEAST and self._clear(refined, promised)):
                break
            if c.effect not in refined:
                frees = (*model.fit.free, *c.frees)
                refined[c.effect] = self.model((*model.effects, c), frees, self._better(starts), model.fit.columns, 2)
        ranked = sorted(refined.values(), key=lambda m: m.heldout)
        for m in ranked[:2]:
            if m.excess < 2.0 * ranked[0].excess + 0.1:
                refined[m.names[-1]] = self.model(m.effects, m.fit.free, m.fit.point, None, 5)
        return sorted(refined.values(), key=lambda m: m.heldout)

    def _clear(self, refined: dict[str, Model], promised: float) -> bool:
        """Whether what is left to try promises far less than what was reached."""
        n = sum(len(self.plant.data.y[c]) for c in self.train)
        return promised / n > 3.0 * min(m.fit.misfit for m in refined.values()) + 0.5

    def _better(self, starts: Sequence[Point]) -> Point:
        """The start that simulates closer to the training cycles."""

        def cost(point: Point) -> float:
            left = residuals(self.plant, self.noise, point, self.train)
            return sum(float(r @ r) for r in left.values())

        return min(starts, key=cost)


class Screened(NamedTuple):
    """A candidate's promise: squared residual on training cycles to first order, and where to begin a fit."""

    promised: float
    candidate: Candidate
    starts: Sequence[Point]


def start_model(search: Search) -> Model:
    """Faults only."""
    return search.model((), K_FREE, {}, None, 5)
