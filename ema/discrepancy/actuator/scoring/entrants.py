"""What the search has fitted, weighed by the engine as hypotheses on one scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.finding.weighing import is_something, within_reach
from ema.discrepancy.actuator.fitting.fit import columns
from ema.discrepancy.actuator.fitting.free import K_FREE, Free, goes_with_temperature
from ema.discrepancy.actuator.fitting.model import Model, ways_of
from ema.discrepancy.actuator.fitting.problem import ActuatorProblem, as_cause
from ema.discrepancy.actuator.simulating.noise import SEED, Noise
from ema.discrepancy.engine.contest import EXPANSIONS, Contest, Entrant, Outcome
from ema.discrepancy.engine.posterior import p_cause
from ema.discrepancy.engine.statistic import Whitening
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

RUNS = 1_000  # seeds of a motion's noise, at most
OTHERS = 4  # sets of effects that are weighed beside faults alone, the answer and what is in it
RECORDS = 16  # simulated records of each
WORTH_A_WORD = 0.01  # a fault


def weigh_sets(
    search: Search, before: Model, after: Model, others: Sequence[Model] = ()
) -> tuple[Outcome, list[Model]]:
    """Probabilities of the sets of effects that were tried, and the best model of each, likeliest first.

    Weighed are faults alone, the answer, what is in it, the `others` given, and those that leave least; and what is in
    the set that leads then, which is brought to its minimum: columns of a fit on its way say that flat directions are
    felt, and sizes with them would be told too surely.
    """
    search.say("probabilities of what was tried")
    after = search.at_minimum(after)
    fitted = [before, after, *_fit_subsets(search, after), *_fit_to_all(search, after), *others]
    while True:
        models = _choose_standing(search, fitted)
        outcome = weigh(search, models)
        entrants = [_entrant(search, m) for m in models]
        first = {(e.names, e.parameters): m for m, e in reversed([*zip(models, entrants, strict=True)])}
        ranked = [first[w.entrant.names, w.entrant.parameters] for w in outcome.weighed]
        leader = search.at_minimum(ranked[0])
        further = [*_fit_subsets(search, leader, models), *([] if leader is ranked[0] else [leader])]
        if not further:
            return outcome, ranked
        search.say(f"{' + '.join(leader.names)}, which leads, and what is in it")
        fitted += further


def weigh(search: Search, models: Sequence[Model]) -> Outcome:
    """Probabilities of the models' sets of effects, and sizes; the first model is faults alone."""
    problem = ActuatorProblem(search.plant)
    entrants = [_entrant(search, m) for m in models]
    return Contest(problem, entrants, _whitening(problem, search.noise), RECORDS, search.say).run(entrants)


def probabilities(outcome: Outcome, model: Model, effect: str, *rivals: str) -> list[float]:
    """Probability that an effect of `model` is there, and of each rival in its place: another effect, or faults."""
    rest = set(model.names) - {effect}
    sets = [rest | ({rival} & set(registry())) for rival in rivals]
    instead = [sum(e.probability for e in outcome.posterior if set(e.causes) == names) for names in sets]
    return [p_cause(outcome.posterior, effect), *instead]


def describe_posterior(outcome: Outcome) -> list[dict[str, Any]]:
    """Sets of causes as in findings.json, likeliest first; none where nothing was tried beside faults."""
    if len(outcome.weighed) < 2:
        return []
    best = {w.entrant.names: w for w in outcome.weighed}
    top = max(w.log_evidence for w in outcome.weighed)
    return [
        {
            "effects": list(entry.causes),
            "faults": [name for name in FAULTS if best[entry.causes].point[name] > WORTH_A_WORD],
            "probability": entry.probability,
            "nats_behind": top - entry.log_evidence,
            "nats_error": best[entry.causes].error,
        }
        for entry in outcome.posterior
    ]


def _fit_subsets(search: Search, answer: Model, known: Sequence[Model] = ()) -> list[Model]:
    """The sets of effects that are in the answer's and not among the `known`, fitted anew from it.

    What was chosen first was chosen without what came later, and what lies on a ridge with it may have been fitted
    with it: that a smaller set does as well shows only where it is fitted itself. What cannot come near the answer is
    not fitted to the end: how far it is behind is told from where that shows.
    """
    found = {frozenset(m.names): m for m in reversed(known)}
    new: list[Model] = []
    larger = [answer]
    while larger:
        model = larger.pop(0)
        for effect in model.effects if len(model.effects) > 1 else ():
            names = frozenset(c.effect for c in model.effects if c != effect)
            if names not in found:
                found[names] = search.without(model, effect, within_reach(answer))
                new.append(found[names])
            larger.append(found[names])
    return new


def _fit_to_all(search: Search, answer: Model) -> list[Model]:
    """Sets that leave no more of training cycles than the answer, fitted to all where others hold motions of their own.

    One motion may not tell two causes apart which two motions do: then the held-out one speaks of what it was not
    asked for. Of each set the model that leaves least of training cycles, or that was fitted to all before.
    """
    motion = search.plant.data.motion
    if set(motion[search.heldout]) <= set(motion[search.train]):
        return []
    best: dict[frozenset[str], Model] = {}
    done: dict[frozenset[str], Model] = {}
    for m in search.tried:
        key = frozenset(m.names)
        if len(m.fit.residuals) == search.plant.data.n_cycles:
            if m.by is search.noise:
                done[key] = m
        elif m.fit.misfit < min(within_reach(answer), best[key].fit.misfit if key in best else np.inf):
            best[key] = m
            done.pop(key, None)  # of a worse start
    return [done.get(key) or search.fitted_to_all(m) for key, m in best.items()]


def _choose_standing(search: Search, first: list[Model]) -> list[Model]:
    """The `first` models, and those of other sets of effects, those that leave least first.

    Of each set, in each way that its effects may act, the last of the first and its best models: where they ended
    apart, all of them count. None but faults alone and the answer has an effect so small that it is none.
    """
    first = [m for k, m in enumerate(first) if k < 2 or _holds_nothing_small(m)]
    sets: dict[frozenset[str], list[Model]] = {frozenset(m.names): [] for m in first}
    for m in reversed(first):
        of = sets[frozenset(m.names)]
        if ways_of(m) not in map(ways_of, of):
            of.append(m)
    most = len(sets) + OTHERS
    for m in sorted(filter(_holds_nothing_small, search.tried), key=lambda m: m.heldout):
        of = sets.setdefault(frozenset(m.names), []) if len(sets) < most else sets.get(frozenset(m.names), [])
        n = sum(ways_of(m) == ways_of(other) for other in of)
        if n < EXPANSIONS and all(m.fit.point != other.fit.point for other in of):
            of.append(m)
    return [m for of in sets.values() for m in of]


def _holds_nothing_small(model: Model) -> bool:
    return all(is_something(model, effect) for effect in model.effects)


def _entrant(search: Search, model: Model) -> Entrant:
    """A fitted model with its columns, simulated once; those that its fit did not need are simulated."""
    if there := next((e for fit, e in search.entrants if fit is model.fit), None):
        return there
    plant, point = search.plant, model.fit.point
    frees = {f.name: f for f in (*K_FREE, *model.fit.free)}
    motions = range(plant.n_motions)
    known = dict(model.fit.columns)
    missing: dict[tuple[Free, ...], list[int]] = {}  # motions that none was fitted to, faults that were not free
    for m in motions:
        missing.setdefault(tuple(f for f in frees.values() if (m, f.name) not in known), []).append(m)
    for new, of in missing.items():
        known |= columns(plant, new, point, of)
    causes = tuple(as_cause(c) for c in model.effects)
    names = [*FAULTS, *(p.name for c in causes for p in c.parameters)]
    for name in names:
        if name not in frees:  # a parameter that a path has fixed
            known |= {(m, name): np.zeros_like(known[m, FAULTS[0]]) for m in motions}
    made = Entrant(causes, point, np.stack([_column(search, known, name) for name in names], axis=1))
    search.entrants.append((model.fit, made))
    return made


def _column(search: Search, known: dict[tuple[int, str], Array], name: str) -> Array:
    data, first = search.plant.data, search.plant.first
    parts = []
    for c in range(data.n_cycles):
        motion = int(data.motion[c])
        dT = data.dT[first[motion]]
        share = 1.0 if not goes_with_temperature(name) else data.dT[c] / dT if dT else 0.0
        parts.append(share * known[motion, name])
    return np.concatenate(parts)


def _whitening(problem: ActuatorProblem, noise: Noise) -> Whitening:
    """The noise that the search has measured, as the engine wants it."""
    sd = np.concatenate([noise.of(c).sd for c in problem.cycles])
    roots = {m: of.root for m, of in enumerate(noise.motions)}
    return Whitening(sd, roots, tuple(problem.blocks), range(SEED, SEED + RUNS))
