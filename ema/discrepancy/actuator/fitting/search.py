"""The state of a search for effects, and what can be asked of a model: fitted, judged, compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.reading.weak import Torque, torque
from ema.discrepancy.actuator.simulating.noise import Noise, Verdict, judge
from ema.discrepancy.actuator.simulating.plant import EmaPlant, Steps
from ema.discrepancy.plant import Point
from ema.discrepancy.progress import Progress

from .candidates import Candidate
from .fit import N_SEEDS, SEED, Columns, Fit, columns_of_all, fit, refit_with_short_steps, residuals, residuals_at
from .flat import settle
from .free import K_FREE, Free
from .model import DISTANT, FAR, FINAL_SEED, N_FINAL, N_GLANCE, Model, free_again, strip

if TYPE_CHECKING:
    from ema.discrepancy.engine.contest import Entrant


@dataclass
class Search:
    """The state of a search: everything that was tried, in order."""

    plant: EmaPlant
    noise: Noise
    train: list[int]
    heldout: list[int]
    say: Progress = field(default_factory=Progress)
    columns: dict[tuple[int, str], Array] = field(default_factory=dict)
    probed: dict[str, Candidate] = field(default_factory=dict)
    tried: list[Model] = field(default_factory=list)
    minima: list[tuple[Fit, Noise]] = field(default_factory=list)
    entrants: list[tuple[Fit, Entrant]] = field(default_factory=list)
    whole: list[tuple[Fit, Model]] = field(default_factory=list)
    replaced: list[tuple[Fit, str, Model]] = field(default_factory=list)

    def is_settled(self, model: Model) -> bool:
        """Whether `model` was brought to its minimum already, by the noise that weighs now."""
        return any(model.fit is fit and self.noise is noise for fit, noise in self.minima)

    def model(
        self,
        effects: Sequence[Candidate],
        frees: Sequence[Free],
        start: Point,
        known: Columns | None,
        n_iterations: int,
        to_beat: float = np.inf,
    ) -> Model:
        """Fit on training cycles, judge on held-out ones."""
        fitted = fit(
            self.plant, self.noise, frees, start, self.train, known=known, n_iterations=n_iterations, to_beat=to_beat
        )
        return self._judged(effects, fitted)

    def settled(self, model: Model) -> Model:
        """`model` at its minimum, along what the record hardly feels too."""
        fitted = settle(self.plant, self.noise, model.fit, self.train)
        if fitted is model.fit:
            fitted = refit_with_short_steps(self.plant, self.noise, model.fit, self.train)
        return self._judged(model.effects, fitted)

    def at_minimum(self, model: Model) -> Model:
        """`model` with every fault free, settled once; itself where it is that already, or far from the data.

        A fault that was dropped since an effect can stand for it may still be there: how far, and what that does to
        the others, is told from where all of them are free.
        """
        is_whole = set(FAULTS) <= {f.name for f in model.fit.free}
        if not model.effects or model.excess >= DISTANT or (is_whole and self.is_settled(model)):
            return model
        if there := next((m for of, m in self.whole if of is model.fit and m.by is self.noise), None):
            return there
        frees = (*K_FREE, *(f for f in model.fit.free if f.name not in FAULTS))
        made = self.settled(model if is_whole else self.model(model.effects, frees, model.fit.point, None, 4))
        self.whole.append((model.fit, made))
        self.minima.append((made.fit, self.noise))
        return made

    def fitted_to_all(self, model: Model) -> Model:
        """`model` fitted to training and held-out cycles alike."""
        cycles = sorted(self.train + self.heldout)
        of, known = model.fit, columns_of_all(self.plant, model.fit)
        fitted = fit(self.plant, self.noise, of.free, of.point, cycles, known=known, n_iterations=4)
        return self._judged(model.effects, fitted)

    def _judged(self, effects: Sequence[Candidate], fitted: Fit) -> Model:
        n_seeds = N_GLANCE if fitted.given_up else N_FINAL
        left = self._misfit(self.noise, fitted.point, self.heldout, n_seeds)
        made = Model(tuple(effects), fitted, left, self.noise)
        self.tried.append(made)
        self.say.fitted(made.names, made.heldout, made.fit.point, by=self.noise)
        return made

    def excess_by(self, noise: Noise, model: Model) -> float:
        """What `model` leaves on held-out cycles beyond another noise."""
        return max(self._misfit(noise, model.fit.point, self.heldout) - 1.0, 0.0)

    def _misfit(self, noise: Noise, point: Point, cycles: Sequence[int], n_seeds: int = N_FINAL) -> float:
        left = residuals(self.plant, noise, point, cycles, n_seeds, FINAL_SEED)
        return noise.misfit(list(left.values()), cycles)

    def verdict(self, model: Model) -> Verdict:
        """Is what `model` leaves on all cycles noise?"""
        cycles = sorted(self.train + self.heldout)
        left = residuals(self.plant, self.noise, model.fit.point, cycles, N_FINAL, FINAL_SEED)
        known, motions = columns_of_all(self.plant, model.fit), enumerate(self.noise.motions)
        cols = [of.white(np.array([known[m, f.name] for f in model.fit.free])).T for m, of in motions]
        return judge(self.noise, [left[c] for c in cycles], cycles, cols, 1.0 / N_FINAL)

    def left_more(self, model: Model, other: Model, noises: Sequence[Noise]) -> float:
        """How much more misfit `model` leaves of all cycles than `other`, on average over noise models."""
        cycles, y = sorted(self.train + self.heldout), self.plant.data.y
        means = self.plant.means([model.fit.point, other.fit.point], cycles, N_FINAL, FINAL_SEED)
        misfits = [
            [noise.misfit([noise.of(c).white(y[c] - at[c]) for c in cycles], cycles) for at in means]
            for noise in noises
        ]
        return float(np.mean([mine - others for mine, others in misfits]))

    def rests(self, model: Model, group: str) -> list[tuple[int, Array, Array]]:
        """Training cycles with what `model` leaves of a balance, and its noise, at the nodes."""
        plant, found = self.plant, []
        means = plant.means([model.fit.point], self.train, plant.n_seeds(self.train, N_SEEDS), SEED)[0]
        for c in self.train:
            at = plant.slices[int(plant.data.motion[c])][group]
            found.append((c, (plant.data.y[c] - means[c])[at], self.noise.of(c).sd[at]))
        return found

    def torques(self, model: Model) -> list[Torque]:
        """What `model` leaves of the torque balance, by training cycle. [N m]"""
        signals, rate = self.plant.data.signals, self.plant.plant.control.rate
        return [torque(signals[c], r, sd, rate) for c, r, sd in self.rests(model, "torque")]

    def owed_to(self, model: Model, effect: Candidate, *, in_training: bool = False) -> float:
        """How much misfit comes back, held-out or in training, when an effect is switched off and all else stays."""
        neutral = {f.name: self.plant.neutral(f.name) for f in effect.frees}
        cycles = self.train if in_training else self.heldout
        without = self._misfit(self.noise, {**model.fit.point, **neutral}, cycles)
        return without - (model.fit.misfit if in_training else model.heldout)

    def without(self, model: Model, effect: Candidate, to_beat: float = np.inf) -> Model:
        """The model fitted anew without one of its effects."""
        effects, frees, point = strip(model, effect)
        return self.model(effects, free_again(frees, effect), point, model.fit.columns, 3, to_beat)

    def instead(self, model: Model, effect: Candidate, rival: Model) -> Model:
        """The model fitted anew with the last effect of `rival` in the place of one of its own, once."""
        c = rival.effects[-1]
        of_it = (m for of, gone, m in self.replaced if of is model.fit and gone == effect.effect)
        if there := next((m for m in of_it if m.effects[-1].way == c.way and m.by is self.noise), None):
            return there
        effects, frees, point = strip(model, effect)
        start = {name: x for name, x in rival.fit.point.items() if name.startswith(f"{c.effect}.")}
        frees = (*free_again(frees, effect), *c.frees)
        made = self.model((*effects, c), frees, {**point, **start}, None, 4)
        self.replaced.append((model.fit, effect.effect, made))
        return made

    def better(self, starts: Sequence[Point], model: Model) -> tuple[Point, float]:
        """The start that simulates closest to the training cycles, and its cost."""
        costs = self.costs(starts, self.train, typical=model.excess > FAR)
        best = int(np.argmin(costs))
        return starts[best], costs[best]

    def costs(
        self,
        points: Sequence[Point],
        cycles: Sequence[int],
        *,
        typical: bool,
        n_seeds: int = N_GLANCE,
        steps: Steps = None,
    ) -> list[float]:
        """Squared residual of some cycles at several points, at a glance.

        The typical one is a geometric mean over cycles and groups of features: far from the data a single one, where
        noise happens to be least, would decide what is nearer.
        """
        left = residuals_at(self.plant, self.noise, points, cycles, n_seeds, SEED, steps)
        return [self._typical(at) if typical else sum(float(r @ r) for r in at.values()) for at in left]

    def _typical(self, left: dict[int, Array]) -> float:
        n, total = 0, 0.0
        for cycle, r in left.items():
            for at in self.plant.slices[int(self.plant.data.motion[cycle])].values():
                n += len(r[at])
                total += len(r[at]) * float(np.log1p(np.mean(r[at] ** 2)))
        return n * float(np.expm1(total / n))


def start_model(search: Search, faults: Point) -> Model:
    """Faults only, from where they are expected."""
    return search.model((), K_FREE, faults, None, 5)
