"""The score has the last word: of all sets that were fitted the likeliest is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ema.discrepancy.actuator.finding.forward import add_effects
from ema.discrepancy.actuator.finding.simpler import fit_alike, fit_one_for_several, keep_alike
from ema.discrepancy.actuator.finding.verdicts import settle_at_minimum
from ema.discrepancy.actuator.finding.weighing import is_credible
from ema.discrepancy.actuator.fitting.model import NEAR, Model, ways_of
from ema.discrepancy.actuator.simulating.noise import Verdict
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.grade import IN_SET, NAMED
from ema.effects import registry

from .entrants import probabilities, weigh_sets
from .faint import N_FITTED, N_RIVALS, fit_faint_effects, fit_rivals, hear, may_hide_something

if TYPE_CHECKING:
    from ema.discrepancy.actuator.finding.paths import Path
    from ema.discrepancy.actuator.fitting.search import Search

Alike = list[tuple[str, ...]]  # for each effect of a model, what does as well in its place


def is_named(outcome: Outcome, model: Model, effect: str, *rivals: str) -> bool:
    """Whether an effect of `model` is told as a cause: one of its set is likely, and that is not faults alone.

    Faults are in every model: where they do as well in its place and are far likelier, nothing is missing. A rival that
    was found beside it since is none: the set with that in its place is the one without the effect.
    """
    rivals = tuple(name for name in rivals if name not in model.names)
    p = dict(zip((effect, *rivals), probabilities(outcome, model, effect, *rivals), strict=True))
    of_effects = sum(x for name, x in p.items() if name in registry())
    return sum(p.values()) >= NAMED and of_effects >= IN_SET * sum(p.values())


def led_by(names: Sequence[str], found: Sequence[str], alike: Alike) -> Alike | None:
    """What may be in the place of each of `names`, where these are `found` but for what may be in their place; or None.

    `alike` holds, for each effect that was found, what may be in its place.
    """
    of: dict[str, tuple[str, ...]] = {}
    for same in ((effect, *rivals) for effect, rivals in zip(found, alike, strict=True)):
        own = next((name for name in same if name in names and name not in of), None)
        if own is not None:
            of[own] = tuple(name for name in same if name != own)
    return [of[name] for name in names] if len(names) == len(found) and of.keys() == set(names) else None


def with_likely(names: Sequence[str], alike: Alike, outcome: Outcome) -> Alike:
    """What may be in the place of each of the effects `names`: of `alike` and what was weighed, if not unlikely.

    What does as well by misfit and is unlikely by the score, as three equal shorts for a weaker magnet, is in no set.
    What was not weighed stays.
    """
    p = {frozenset(e.causes): e.probability for e in outcome.posterior}
    found = []
    for effect, rivals in zip(names, alike, strict=True):
        rest = frozenset(names) - {effect}
        others = [next(iter(of - rest)) for of in p if rest < of and len(of) == len(names) and effect not in of]
        of_each = {name: p.get(rest | ({name} & set(registry()))) for name in (*rivals, *others)}
        least = IN_SET * (p.get(rest | {effect}, 0.0) + sum(x for x in of_each.values() if x is not None))
        found.append(tuple(name for name, x in of_each.items() if x is None or x > least))
    return found


@dataclass(frozen=True)
class Answer:
    """A model with its verdict and, for each of its effects, what does as well in its place."""

    model: Model
    verdict: Verdict
    alike: Alike


def take_likeliest(search: Search, path: Path, found: Answer) -> tuple[Outcome, Answer, list[str]]:
    """All sets weighed; the likeliest where what was found has an effect less likely than not; and notes.

    Where about noise is left, what the score hears all the same is taken for found. Of effects that may stand in each
    other's place the likeliest comes first.
    """
    outcome, models, found = _listen(search, path, found)
    found, notes = _prefer_likeliest(search, path, found, outcome, models)
    alike = [keep_alike(search, found.model, j, rivals) for j, rivals in enumerate(found.alike)]
    return outcome, replace(found, alike=with_likely(found.model.names, alike, outcome)), notes


def _listen(search: Search, path: Path, found: Answer) -> tuple[Outcome, list[Model], Answer]:
    """All sets weighed, likeliest first, and what was found with all that the score hears beside it."""
    others: list[Model] = []
    while True:
        n = N_RIVALS if found.model.effects else N_FITTED
        faint = fit_faint_effects(search, found.model, n) if may_hide_something(found.model, found.verdict) else []
        others = [m for m in others if not set(m.names) <= set(found.model.names)]  # first fits, not at the minimum
        others += faint
        outcome, models = weigh_sets(search, path.before, found.model, others)
        heard = hear(outcome, models, found.model) if faint else None
        if heard is None:
            break
        found = _go_on_from_heard(search, path, found, *heard)
    if rivals := _fit_unweighed(search, found, models):
        outcome, models = weigh_sets(search, path.before, found.model, [*others, *rivals])
    return outcome, models, found


def _prefer_likeliest(
    search: Search, path: Path, found: Answer, outcome: Outcome, models: Sequence[Model]
) -> tuple[Answer, list[str]]:
    """What was found, or of `models` the likeliest where that has what is less likely than not; and notes."""
    best = models[0]
    sets = [(name, *rivals) for name, rivals in zip(found.model.names, found.alike, strict=True)]
    unlikely = [names[0] for names in sets if not is_named(outcome, found.model, *names)]
    if unlikely and best.effects and not is_credible(best):
        notes = [f"{', '.join(unlikely)} would do, but what can be no cause would do much better: not named"]
        return Answer(path.before, path.verdict_before, []), notes
    if unlikely:
        search.say(f"{' + '.join(best.names) or 'faults only'} instead of {' + '.join(found.model.names)}")
        of = dict(zip(found.model.names, found.alike, strict=True))
        v = search.verdict(best) if best.effects else path.verdict_before
        return Answer(best, v, [of.get(name, ()) for name in best.names]), []
    if best.names != found.model.names and (led := led_by(best.names, found.model.names, found.alike)):
        search.say(f"{' + '.join(best.names)} first: what may be in its place is less likely")
        return Answer(best, search.verdict(best), led), []
    return found, []


def _fit_unweighed(search: Search, found: Answer, weighed: Sequence[Model]) -> list[Model]:
    """What may be in the place of effects of an answer, by a search or by what it promises, and was not weighed."""
    fitted = [fit_alike(search, found.model, j, rivals) for j, rivals in enumerate(found.alike)]
    fewer = fit_one_for_several(search, found.model) if found.model.excess < NEAR else []
    known = {ways_of(m) for m in weighed}
    alike = [m for of in (*(x.values() for x in fitted), fewer) for m in of if ways_of(m) not in known]
    return [*alike, *fit_rivals(search, found.model, [*weighed, *alike])]


def _go_on_from_heard(search: Search, path: Path, found: Answer, model: Model, rivals: tuple[str, ...]) -> Answer:
    """What the score has heard beside what was `found`, at its minimum, and what there is to be found beside both."""
    left = " + ".join(found.model.names) or "faults alone"
    search.say(f"{model.names[-1]}: {left} leave about noise, and the score hears more")
    alike = [*found.alike, rivals]
    model, v = settle_at_minimum(search, model, search.verdict(model), alike)
    if not v.is_noise:
        model, v = add_effects(search, path.before, model, v, alike)
    return Answer(model, v, alike)
