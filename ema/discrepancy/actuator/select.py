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
    columns,
    fit,
    moved,
    residuals,
    residuals_at,
    stacked_jacobian,
    with_short_steps,
)
from .flat import settled
from .noise import Noise, Verdict, verdict
from .plant import EmaPlant, Point, Steps
from .weak import Torque, torque

N_FINAL = 16  # seeds of a mean that is judged
FINAL_SEED = 3_000_000
N_GLANCE = 4  # seeds that tell a good start from a bad one
N_PROBE, N_PROBE_HIDDEN = 8, 24  # seeds of a column that only screens; of one that is hardly felt
WIDER = 3.0  # times the step of an effect that is hardly felt
FELT = 0.5  # cosine between halves of the seeds, below which a column is mostly noise
DT_PROBE = 2e-6  # [s] step of a simulation that only screens: its columns are within 4 % (12 % for dead time)
N_REFINED = 4
WORTH_A_FIT = 0.1  # share of the squared residual beyond noise that a candidate must promise, to first order
AT_LEAST = 0.01  # share of the whole squared residual that it must promise
N_REFINED_AT_LEAST = 2
NO_WORSE = 1.5  # times the squared residual of the best start, from which a start with fewer faults is not preferred
HOPELESS = 5.0  # held-out misfit after a few steps from which an effect in place of faults is given up
ONE_CAUSE = 0.25  # relative spread up to which several parameters are one cause
K_SEEN = 0.01  # a fault that is there
CHANCE = 0.03  # difference in misfit that seeds make
COLLINEAR = 0.8  # cosine from which two effects look like each other
RESEMBLING = 0.3  # cosine by probes at the nominal point, from which they are compared where the fit is
FAR = 100.0  # excess from which candidates are simulated before they are ranked
NEARLY = 1.5  # misfit of a model that may be the right one, but for noise that is not its own
NEARLY_ALL = 0.01  # share of what there was to explain, up to which a rival may still leave it for want of iterations
NEAR_NOISE = 0.05  # excess below which a fit need not go on
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
    probed: dict[str, Candidate] = field(default_factory=dict)
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
        return self._judged(effects, fitted)

    def settled(self, model: Model) -> Model:
        """`model` at its minimum, along what the record hardly feels too."""
        fitted = settled(self.plant, self.noise, model.fit, self.train)
        if fitted is model.fit:
            fitted = with_short_steps(self.plant, self.noise, model.fit, self.train)
        return self._judged(model.effects, fitted)

    def _judged(self, effects: Sequence[Candidate], fitted: Fit) -> Model:
        made = Model(tuple(effects), fitted, self._misfit(self.noise, fitted.point, self.heldout))
        self.tried.append(made)
        self.say(f"{' + '.join(made.names) or 'faults only'}: held-out misfit {made.heldout:.3g}")
        return made

    def excess_by(self, noise: Noise, model: Model) -> float:
        """What `model` leaves on held-out cycles beyond another noise."""
        return max(self._misfit(noise, model.fit.point, self.heldout) - 1.0, 0.0)

    def _misfit(self, noise: Noise, point: Point, cycles: Sequence[int]) -> float:
        left = residuals(self.plant, noise, point, cycles, N_FINAL, FINAL_SEED)
        return noise.misfit(list(left.values()), cycles)

    def verdict(self, model: Model) -> Verdict:
        """Is what `model` leaves on all cycles noise?"""
        cycles = sorted(self.train + self.heldout)
        left = residuals(self.plant, self.noise, model.fit.point, cycles, N_FINAL, FINAL_SEED)
        frees, motions = model.fit.free, range(self.plant.n_motions)
        only_heldout = [m for m in motions if any((m, f.name) not in model.fit.columns for f in frees)]
        known = model.fit.columns | columns(self.plant, frees, model.fit.point, only_heldout)
        cols = [self.noise.motions[m].white(np.array([known[m, f.name] for f in frees])).T for m in motions]
        return verdict(self.noise, [left[c] for c in cycles], cycles, cols, 1.0 / N_FINAL)

    def left_more(self, model: Model, other: Model, noises: Sequence[Noise]) -> float:
        """How much more misfit `model` leaves of all cycles than `other`, on average over noise models."""
        cycles, y = sorted(self.train + self.heldout), self.plant.data.y
        means = self.plant.means([model.fit.point, other.fit.point], cycles, N_FINAL, FINAL_SEED)
        misfits = [
            [noise.misfit([noise.of(c).white(y[c] - at[c]) for c in cycles], cycles) for at in means]
            for noise in noises
        ]
        return float(np.mean([mine - others for mine, others in misfits]))

    def torques(self, model: Model) -> list[Torque]:
        """What `model` leaves of the torque balance, by training cycle. [N m]"""
        plant = self.plant
        found = []
        means = plant.means([model.fit.point], self.train, plant.n_seeds(self.train, N_SEEDS), SEED)[0]
        for c in self.train:
            motion = int(plant.data.motion[c])
            at = plant.slices[motion]["torque"]
            r = plant.data.y[c] - means[c]
            sd = self.noise.of(c).sd
            found.append(torque(plant.data.signals[c], r[at], sd[at], plant.plant.control.rate))
        return found

    def probe(self, found: Sequence[Candidate]) -> list[Candidate]:
        """Fill in the columns (per unit) of what was not probed before; what is hardly felt comes with longer steps."""
        new = [c for c in found if c.key not in self.probed]
        hidden = self._probe(new, N_PROBE)
        self._probe([c.wider(WIDER) for c in new if c.key in hidden], N_PROBE_HIDDEN)
        return [self.probed[c.key] for c in found]

    def _probe(self, found: Sequence[Candidate], n_seeds: int) -> set[str]:
        """Simulate probes; keys of candidates whose columns are mostly noise, as two halves of the seeds tell."""
        if not found:
            return set()
        first = self.plant.first
        points = [{}, *(p for c in found for p in c.probes())]
        here, *there = self.plant.repeated(points, first, n_seeds, SEED, (DT_PROBE,))
        probed, hidden = iter(there), set()
        for c in found:
            self.probed[c.key] = c
            for j, amount in enumerate(c.amounts):
                runs = next(probed)
                halves = []
                for motion, cycle in enumerate(first):
                    column = (runs[cycle].features - here[cycle].features) / amount
                    self.columns[motion, c.probe_name(j)] = column.mean(axis=0)
                    white = self.noise.motions[motion].white(column)
                    halves.append([white[half::2].mean(axis=0) for half in (0, 1)])
                a, b = np.concatenate(halves, axis=1)
                if a @ b < FELT * np.linalg.norm(a) * np.linalg.norm(b):
                    hidden.add(c.key)
        return hidden

    def screen(self, model: Model, found: Sequence[Candidate]) -> list[Screened]:
        """What each candidate promises to first order next to all that `model` has free, best first."""
        found = self.probe(found)
        f = model.fit
        own = stacked_jacobian(self.noise, f.free, f.columns, self.train)
        r = np.concatenate([f.residuals[c] for c in self.train])
        low, high = bounds(f.free, f.point)
        ranked = []
        for c in found:
            J = self._columns(c)
            c_low, c_high = c.limits()
            step, promised = bounded(
                np.concatenate([own, J], axis=1), r, np.concatenate([low, c_low]), np.concatenate([high, c_high])
            )
            start = {**moved(f.point, f.free, step[: len(f.free)]), **c.start(step[len(f.free) :])}
            ranked.append(Screened(promised, c, start))
        ranked = [s for s in ranked if not any(_does_as_well(t, s, AT_LEAST * float(r @ r)) for t in ranked)]
        return sorted(ranked, key=lambda entry: entry.promised)

    def owed_to(self, model: Model, effect: Candidate, *, in_training: bool = False) -> float:
        """How much misfit comes back, held-out or in training, when an effect is switched off and all else stays."""
        neutral = {f.name: self.plant.neutral(f.name) for f in effect.frees}
        cycles = self.train if in_training else self.heldout
        without = self._misfit(self.noise, {**model.fit.point, **neutral}, cycles)
        return without - (model.fit.misfit if in_training else model.heldout)

    def _columns(self, c: Candidate) -> Array:
        names = [Free(c.probe_name(j), 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
        return stacked_jacobian(self.noise, names, self.columns, self.train)

    def start_with(self, model: Model, c: Candidate, faults: Point) -> Point:
        """A start with some faults of `model` at other values, where the effect stands for what that takes away."""
        return self._starts_with(model, [c], faults)[0]

    def _starts_with(self, model: Model, found: Sequence[Candidate], faults: Point) -> list[Point]:
        point = {**model.fit.point, **faults}
        left = residuals(self.plant, self.noise, point, self.train, N_GLANCE)
        r = np.concatenate([left[cycle] for cycle in self.train])
        return [{**point, **c.start(bounded(self._columns(c), r, *c.limits())[0])} for c in found]

    def without(self, model: Model, effect: Candidate) -> Model:
        """The model fitted anew without one of its effects."""
        effects, frees, point = _stripped(model, effect)
        return self.model(effects, frees, point, model.fit.columns, 3)

    def instead(self, model: Model, effect: Candidate, rival: Model) -> Model:
        """The model fitted anew with the last effect of `rival` in the place of one of its own."""
        effects, frees, point = _stripped(model, effect)
        c = rival.effects[-1]
        start = {name: x for name, x in rival.fit.point.items() if name.startswith(f"{c.effect}.")}
        return self.model((*effects, c), (*frees, *c.frees), {**point, **start}, None, 4)

    def promising(self, model: Model) -> list[Screened]:
        """All that may stand beside the effects of `model`, by what it promises to first order."""
        line = "torque_line" if "cogging" in model.names else "cogging"
        found = candidates(self.plant.plant, self.plant.data, self.torques(model), line, self.plant.resonance)
        return self.screen(model, [c for c in found if c.effect not in model.names])

    def extend(self, model: Model, screened: Sequence[Screened], known: Sequence[Model] = ()) -> list[Model]:
        """The best models with one more effect of those screened, best first.

        With `known`, those that first order has led to, candidates that are not among them are simulated instead.
        """
        tried = {m.names[-1] for m in known}
        screened = [s for s in screened if s.candidate.effect not in tried]
        refined: dict[str, Model] = {}
        cost = sum(float(r @ r) for r in model.fit.residuals.values())
        worth = max(WORTH_A_FIT * (cost - cost / model.fit.misfit), AT_LEAST * cost)
        if known or model.excess > FAR:
            screened = self._simulated(model, screened)
        # One cause for several faults is tried whatever it promises, since the faults hide that: unless another,
        # simulated far from the data, takes nearly all by itself.
        alone = model.excess > FAR and screened[0].promised < NEARLY_ALL * cost
        for s in () if alone else screened:
            if s.candidate.effect not in refined and self._stands_for_faults(model, s.candidate):
                refined[s.candidate.effect] = self._refined(model, s)
        others: dict[str, Model] = {}
        for s in screened:
            if (refined or others) and cost - s.promised < worth:
                break
            if len(others) >= N_REFINED or (len(others) >= N_REFINED_AT_LEAST and self._clear(others, s.promised)):
                break
            if s.candidate.effect not in {**refined, **others}:
                others[s.candidate.effect] = self._refined(model, s)
        refined |= others
        best = min(refined.values(), key=lambda m: m.heldout)
        for s in self._looking_like(model, best, screened, set(refined)):
            m = self._refined(model, s)
            effect = s.candidate.effect
            refined[effect] = min(m, refined.get(effect, m), key=lambda x: x.heldout)
        # A rival is out only if it leaves more when fitted as well as the best.
        for name, m in self._close(refined, model):
            again = self.model(m.effects, m.fit.free, m.fit.point, None, 4)
            refined[name] = min(m, again, key=lambda x: x.heldout)
        return sorted(refined.values(), key=lambda m: m.heldout)

    def instead_of_faults(self, model: Model) -> list[Model]:
        """Models in which one effect stands for what several faults have in common, and as many of them vanish.

        A weaker magnet and three equal shorts are the same torque at the same current; the fewer causes, the likelier.
        """
        k = model.fit.point
        found = []
        for c in candidates(self.plant.plant, self.plant.data, []):
            common, gone = _common(model, c)
            if c.effect in model.names or not gone or len(gone) < len(c.linear):
                continue
            (c,) = self.probe([c])
            while made := self._in_place_of(model, c, gone, common):
                values = np.array([made.fit.point[f"{c.effect}.{name}"] for name in c.linear])
                if np.ptp(values) <= ONE_CAUSE * abs(values.mean()):
                    found.append(made)
                gone.remove(max(gone, key=lambda name: k[name]))  # what is small may be there
                if made.heldout < model.heldout + CHANCE or len(gone) < len(c.linear):
                    break
        return sorted(found, key=lambda m: m.heldout)

    def alike(self, model: Model, best: Model, known: set[str]) -> list[Model]:
        """What can do nearly all that the last effect of `best` does in place of faults of `model`, fitted like it."""
        effects, frees, rest = _stripped(best, best.effects[-1])
        gone = {f.name: 0.0 for f in model.fit.free if f.name not in {g.name for g in frees}}
        return [
            self.model((*effects, s.candidate), (*frees, *s.candidate.frees), {**rest, **s.start, **gone}, None, 5)
            for s in self._looking_like(model, best, self.promising(model), known)
        ]

    def without_common_faults(self, model: Model, c: Candidate) -> Model | None:
        """`model` without what the faults that one of its effects can be mistaken for have in common, if they do."""
        common, gone = _common(model, c)
        if not gone:
            return None
        rest, frees = _without_common(model, c, common, gone)
        return self.model(model.effects, frees, {**model.fit.point, **rest}, model.fit.columns, 7)

    def _in_place_of(self, model: Model, c: Candidate, gone: Sequence[str], common: float) -> Model | None:
        """`model` with an effect for what several faults have in common, and without those of them that are gone."""
        rest, frees = _without_common(model, c, common, gone)
        made = self.model((*model.effects, c), (*frees, *c.frees), self.start_with(model, c, rest), None, 3)
        if made.heldout > HOPELESS:
            return None
        return self.model(made.effects, made.fit.free, made.fit.point, made.fit.columns, 7)

    def _looking_like(
        self, model: Model, best: Model, screened: Sequence[Screened], fitted: set[str]
    ) -> list[Screened]:
        """Those that can do, beside what else is free, nearly all that the last effect of `best` does.

        What probes do where nothing else acts may mislead: what resembles the effect there is asked once more where
        `best` is, and begins with what does the same there. So is what was fitted already, if the effect has taken the
        place of faults: from these no fit gets there.
        """
        effect = best.effects[-1]
        names = [f"{effect.effect}.{name}" for name in effect.linear]
        values = np.array([best.fit.point[name] - self.plant.neutral(name) for name in names])
        frees = [f for f in best.fit.free if f.name in names]
        done = stacked_jacobian(self.noise, frees, best.fit.columns, self.train) @ values
        replaced = effect.faults if self._stands_for_faults(model, effect) else []
        others, rest = _stripped(best, effect)[1:]
        free, others = (tuple(f for f in of if f.name not in replaced) for of in (model.fit.free, others))
        own = stacked_jacobian(self.noise, free, model.fit.columns, self.train)
        own_there = stacked_jacobian(self.noise, others, best.fit.columns, self.train)
        found: dict[str, Screened] = {}
        for s in screened:
            c = s.candidate
            if c.effect in found or c.effect == effect.effect or (c.effect in fitted and not replaced):
                continue
            share = _doing(done, self._columns(c), own)
            if share > COLLINEAR and c.effect not in fitted:
                found[c.effect] = s
            elif share > RESEMBLING:
                J = self._columns_at(best.fit.point, c)
                if _doing(done, J, own_there) > COLLINEAR:
                    limits = zip(bounds(others, rest), c.limits(), strict=True)
                    low, high = (np.concatenate(ends) for ends in limits)
                    step, _ = bounded(np.concatenate([own_there, J], axis=1), done, low, high)
                    start = {**moved(rest, others, step[: len(others)]), **c.start(step[len(others) :])}
                    found[c.effect] = s._replace(start=start)
        return list(found.values())

    def _columns_at(self, point: Point, c: Candidate) -> Array:
        """Whitened columns (per unit) of a candidate beside all that a point has."""
        first = self.plant.first
        points = [point, *({**point, **probe} for probe in c.probes())]
        here, *there = self.plant.means(points, first, N_PROBE, SEED, (DT_PROBE,))
        names = [Free(c.probe_name(j), 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
        cols = {
            (motion, f.name): (at[cycle] - here[cycle]) / amount
            for f, amount, at in zip(names, c.amounts, there, strict=True)
            for motion, cycle in enumerate(first)
        }
        return stacked_jacobian(self.noise, names, cols, self.train)

    def _simulated(self, model: Model, screened: Sequence[Screened]) -> list[Screened]:
        """Candidates by what their starts leave when simulated: far from the data first order promises little."""
        motions = self.plant.data.motion
        cycles = [next(c for c in self.train if motions[c] == m) for m in sorted({int(motions[c]) for c in self.train})]
        none = dict.fromkeys(FAULTS, 0.0)
        alone = self._starts_with(model, [s.candidate for s in screened], none)
        starts = [
            [s.start, other, *({**model.fit.point, **none, **size} for size in s.candidate.sizes())]
            for s, other in zip(screened, alone, strict=True)
        ]
        points = [point for of in starts for point in of]
        here, *there = self._costs([model.fit.point, *points], cycles, typical=True, steps=(DT_PROBE,))
        cost = sum(float(r @ r) for r in model.fit.residuals.values())
        costs = iter(there)
        ranked = []
        for s, of in zip(screened, starts, strict=True):
            least, best = min((next(costs), at) for at in range(len(of)))
            ranked.append(Screened(cost * least / here, s.candidate, of[best]))
        return sorted(ranked, key=lambda entry: entry.promised)

    def _close(self, refined: dict[str, Model], model: Model) -> list[tuple[str, Model]]:
        """The models near the best, by what there was to explain too; none if the best stands alone without a rest."""
        ranked = sorted(refined.items(), key=lambda item: item[1].heldout)
        best = ranked[0][1]
        near = [
            (name, m) for name, m in ranked[:3] if m.excess < max(2.0 * best.excess + 0.2, NEARLY_ALL * model.excess)
        ]
        return near if len(near) > 1 or best.excess > NEAR_NOISE else []

    def _refined(self, model: Model, s: Screened) -> Model:
        frees = (*model.fit.free, *s.candidate.frees)
        start, cost = self._better([s.start, self.start_with(model, s.candidate, dict.fromkeys(FAULTS, 0.0))], model)
        if self._stands_for_faults(model, s.candidate):
            # One effect for several faults, or for what they have in common, is the simpler cause; noise in the
            # columns would leave the faults there.
            faults = s.candidate.faults
            k = model.fit.point
            common = min(k[name] for name in faults)
            less = (dict.fromkeys(faults, 0.0), {name: k[name] - common for name in faults})
            nearer, _ = self._better([self.start_with(model, s.candidate, rest) for rest in less], model)
            # From there the effect alone goes as far as it can.
            alone = fit(self.plant, self.noise, s.candidate.frees, nearer, self.train, n_iterations=3)
            simpler, simpler_cost = self._better([alone.point], model)
            if simpler_cost < NO_WORSE * cost:
                start = simpler
        return self.model((*model.effects, s.candidate), frees, start, model.fit.columns, 3)

    def _stands_for_faults(self, model: Model, c: Candidate) -> bool:
        """Whether all of the several faults that the effect can be mistaken for are seen in the model."""
        faults = c.faults
        return len(faults) > 1 and all(model.fit.point.get(name, 0.0) > K_SEEN for name in faults)

    def _clear(self, refined: dict[str, Model], promised: float) -> bool:
        """Whether one leaves nearly nothing, and what is left to try promises far less."""
        n = sum(len(self.plant.data.y[c]) for c in self.train)
        reached = min(m.fit.misfit for m in refined.values())
        return reached < NEARLY and promised / n > 3.0 * reached + 0.5

    def _better(self, starts: Sequence[Point], model: Model) -> tuple[Point, float]:
        """The start that simulates closest to the training cycles, and its cost."""
        costs = self._costs(starts, self.train, typical=model.excess > FAR)
        best = int(np.argmin(costs))
        return starts[best], costs[best]

    def _costs(
        self, points: Sequence[Point], cycles: Sequence[int], *, typical: bool, steps: Steps = None
    ) -> list[float]:
        """Squared residual of some cycles at several points, at a glance.

        The typical one is a geometric mean over cycles and groups of features: far from the data a single one, where
        noise happens to be least, would decide what is nearer.
        """
        left = residuals_at(self.plant, self.noise, points, cycles, N_GLANCE, SEED, steps)
        return [self._typical(at) if typical else sum(float(r @ r) for r in at.values()) for at in left]

    def _typical(self, left: dict[int, Array]) -> float:
        n, total = 0, 0.0
        for cycle, r in left.items():
            for at in self.plant.slices[int(self.plant.data.motion[cycle])].values():
                n += len(r[at])
                total += len(r[at]) * float(np.log1p(np.mean(r[at] ** 2)))
        return n * float(np.expm1(total / n))


def _doing(done: Array, columns: Array, own: Array) -> float:
    """What share of something columns can do beside others."""
    Q, _ = np.linalg.qr(own)
    done, columns = (x - Q @ (Q.T @ x) for x in (done, columns))
    values = np.linalg.lstsq(columns, done, rcond=None)[0]
    return float(np.linalg.norm(columns @ values)) / max(float(np.linalg.norm(done)), 1e-300)


def _common(model: Model, c: Candidate) -> tuple[float, list[str]]:
    """What the several faults that an effect can be mistaken for have in common, and which of them are no larger."""
    faults = {name: model.fit.point.get(name, 0.0) for name in c.faults}
    common = min(faults.values(), default=0.0)
    if len(faults) < 2 or common < K_SEEN:
        return 0.0, []
    return common, [name for name, x in faults.items() if x - common < K_SEEN]


def _without_common(model: Model, c: Candidate, common: float, gone: Sequence[str]) -> tuple[Point, tuple[Free, ...]]:
    """Faults of an effect less what they have in common, zero where they are gone, and what else stays free."""
    rest = {name: 0.0 if name in gone else model.fit.point[name] - common for name in c.faults}
    return rest, tuple(f for f in model.fit.free if f.name not in gone)


def _stripped(model: Model, effect: Candidate) -> tuple[tuple[Candidate, ...], tuple[Free, ...], Point]:
    """Effects, free parameters and point of a model without one of its effects."""
    own = {f.name for f in effect.frees}
    point = {name: x for name, x in model.fit.point.items() if not name.startswith(f"{effect.effect}.")}
    effects = tuple(c for c in model.effects if c != effect)
    return effects, tuple(f for f in model.fit.free if f.name not in own), point


class Screened(NamedTuple):
    """A candidate's promise: squared residual on training cycles to first order, and where to begin a fit."""

    promised: float
    candidate: Candidate
    start: Point


def _does_as_well(simpler: Screened, s: Screened, hardly: float) -> bool:
    """Whether the same effect with fewer parameters promises hardly less."""
    fewer = len(simpler.candidate.linear) < len(s.candidate.linear)
    return simpler.candidate.effect == s.candidate.effect and fewer and simpler.promised < s.promised + hardly


def start_model(search: Search, faults: Point) -> Model:
    """Faults only, from where they are expected."""
    return search.model((), K_FREE, faults, None, 5)
