"""Rounds of a selection: what is added to a model, dropped from it, or takes the place of something in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from .form import FORM
from .grade import LIMIT
from .plant import Candidate, Plant, Point
from .progress import Progress
from .selection import (
    BETTER,
    N_FOLDS,
    Tried,
    above_noise,
    choose,
    compare,
    find_likeliest,
    fit_base,
    fit_model,
    fit_with_each,
    is_nameless,
    is_worth_it,
    may_be_worth_it,
    superpose,
)
from .superposing import rank_sets
from .verdict import Verdict, judge

MAX_EFFECTS = 3
MAX_TERMS = 3
MAX_ADDED = 5  # of both kinds, further lines of a kind that is there already counted too
IMMATERIAL = 0.01  # of the noise's mean square: what takes less is told, and no cause: no plant file is that exact
MANY = 12  # free parameters from which an effect is revised beside its strongest rivals only
N_RIVALS = 6
N_SETS = 2  # of each size that should explain most in the place of what was found one by one, and are fitted


Reread = Callable[[Tried, Tried], bool]
"""Reads the records another way where a model then foretells them better than one with a further effect does."""


Together = Callable[[Point], Sequence[Candidate]]
"""Effects that something else than a simulation shows beside each other, at a point without effects."""


def never(model: Tried, further: Tried) -> bool:
    """Records that can be taken one way only."""
    return False


@dataclass
class State:
    """Models without effects and so far, and for each accepted effect the trials in its place and the model without.

    `forward` are the trials beside nothing and beside the first effect, each with the model before; `besides` sets of
    effects that were fitted in the place of the model.
    `reread` weighs a condition of the records against a further effect; where it says so, the selection begins again.
    `unlikely` are rows of what was considered and is less likely than not (`Findings.rejected`).
    """

    plain: Tried
    model: Tried
    rounds: list[tuple[dict[str, Tried], Tried]]
    tried: list[dict[str, Any]]
    n_rounds: int = 0
    library_only: bool = False  # no nameless terms
    reread: Reread = never
    forward: list[tuple[dict[str, Tried], Tried]] = field(default_factory=list)
    besides: list[Tried] = field(default_factory=list)
    unlikely: list[dict[str, Any]] = field(default_factory=list)
    immaterial: str = ""  # what ended the selection by taking less than matters


def is_explained(plant: Plant, plain: Tried, model: Tried) -> bool:
    """Noise is left, or little more, or what the wrong form of the laws found may leave."""
    return above_noise(model) < FORM**2 * above_noise(plain) or is_nearly_noise(plant, model)


def is_nearly_noise(plant: Plant, model: Tried) -> bool:
    """Noise is left, or little more."""
    return model.rms <= LIMIT or judge_model(plant, model).is_noise


def judge_model(plant: Plant, model: Tried) -> Verdict:
    """Whether what a model leaves of held-out parts is noise."""
    n_free = sum(len(f.free) for f in model.fits)
    return judge(model.held_out, noise_uncertainty=plant.noise_uncertainties, n_free=n_free)


def select(plant: Plant, state: State, progress: Progress) -> None:
    """Forward selection until the residual is noise, nothing helps, or enough kinds are in the model.

    Of several effects that are there, the first may gain no more than chance while the others are missing. It is taken
    all the same: `revise` asks each what it is worth beside the others.
    Dry friction has side minima: where the model does as well without an effect, begun where the fit with it ended, the
    gain was not the effect's own.
    """
    begun_anew_with = -1  # effects
    while not judge_model(plant, state.model).is_noise:
        trials = _round(plant, state, state.model, progress)
        n = len(state.model.accepted)
        if n + 2 <= MAX_EFFECTS:
            state.forward = [*state.forward[:n], (trials, state.model)]
        best = choose(trials, state.model) if trials else None
        if best is None or not may_be_worth_it(trials[best], state.model):
            return
        if state.reread(state.model, trials[best]):
            state.plain = state.model = fit_base(plant)
            state.rounds.clear()
            begun_anew_with = -1
            continue
        candidate = trials[best].accepted[-1]
        if candidate.is_structure and is_explained(plant, state.plain, state.model):
            return  # what the wrong form of a law leaves needs no cause of its own
        kinds = {c.effect for c in state.model.accepted if c.is_structure == candidate.is_structure}
        if candidate.effect not in kinds and len(kinds) >= (MAX_TERMS if candidate.is_structure else MAX_EFFECTS):
            return
        if len(state.model.accepted) >= MAX_ADDED:
            return
        if (mark := above_noise(state.model) - above_noise(trials[best])) < IMMATERIAL:
            state.immaterial = f"{candidate.key} would take {mark:.1%} of the noise's mean square from it"
            return
        n = len(state.model.accepted)
        again = leave_out(plant, trials[best], {n})
        if compare(again, state.model).gain > 0.0 and not may_be_worth_it(trials[best], again):
            if n == begun_anew_with:
                return
            begun_anew_with = n
            state.model, state.plain = again, again if n == 0 else state.plain
            continue
        state.rounds.append((trials, state.model))
        state.model = trials[best]


def try_library_alone(plant: Plant, state: State, progress: Progress) -> State:
    """Effects of the library alone, where they foretell held-out parts as well as with nameless terms.

    One term may do what two effects do: friction that knows directions beside a spring is a force along the travel.
    """
    if not any(c.is_structure for c in state.model.accepted):
        return state
    progress("effects of the library alone")
    other = State(state.plain, state.plain, [], state.tried, state.n_rounds, library_only=True, reread=state.reread)
    select(plant, other, progress)
    revise(plant, other, progress)
    few = len(other.model.accepted) <= len(state.model.accepted) + 1
    as_well = is_explained(plant, other.plain, other.model) and not compare(state.model, other.model).is_clear
    return other if few and as_well else state


def try_together(plant: Plant, state: State, together: Together, progress: Progress) -> State:
    """Effects that were seen beside each other, where those found one by one leave more than noise.

    Of two that are there, neither alone may foretell much, and a third that is not there does what they have in common:
    it leaves what looks like the form of a law. Records are not read another way here: that would begin without them.
    """
    if is_nearly_noise(plant, state.model):
        return state
    found = tuple(together(state.plain.fits[0].point))[:MAX_EFFECTS]
    if len(found) < 2 or {c.key for c in found} <= {c.key for c in state.model.accepted}:
        return state
    progress("effects that the records show beside each other")
    start = {name: value for c in found for name, value in c.starts[0].items()}
    model = fit_model(plant, [found] * N_FOLDS, [[{**own.point, **start}] for own in state.plain.fits])
    if not is_worth_it(model, state.plain):
        return state
    other = State(
        state.plain, model, [({}, state.plain)] * len(found), state.tried, state.n_rounds, forward=state.forward
    )
    revise(plant, other, progress)
    select(plant, other, progress)
    revise(plant, other, progress)
    return other if compare(other.model, state.model).is_significant else state


def try_sets(plant: Plant, state: State, progress: Progress) -> State:
    """Sets of effects that should explain as much together as those found one by one: the likeliest is the model.

    Whether it is or not, the others are weighed beside it.
    """
    if not state.model.accepted:
        return state
    for trials, before in state.forward:
        for keys in _instead(plant, state, trials, before):
            progress(" + ".join((*(c.key for c in before.accepted), *keys)))
            state.besides.append(superpose(plant, before, [trials[key] for key in keys]))
    best = find_likeliest(state.model, state.besides)
    if best is state.model:
        return state
    besides = [t for t in (state.model, *state.besides) if t is not best]
    rounds: list[tuple[dict[str, Tried], Tried]] = [({}, state.plain)] * len(best.accepted)
    other = replace(state, model=best, rounds=rounds, besides=besides)
    revise(plant, other, progress)
    select(plant, other, progress)
    revise(plant, other, progress)
    return other


def _instead(plant: Plant, state: State, trials: dict[str, Tried], before: Tried) -> list[tuple[str, ...]]:
    """What to add to the model `before`, of what was tried there: sets that were not fitted, the best of each size.

    And the best without each of the model's effects. None holds all of these: beside them no further one was worth it.
    """
    fitted = [before, *(t for of, _ in state.rounds for t in of.values()), *state.besides]
    known = [{c.key for c in t.accepted} for t in fitted]
    model, there = ({c.key for c in t.accepted} for t in (state.model, before))
    fits = {key: t.fits for key, t in trials.items() if not is_nameless(key, t)}
    ranked = [keys for _, keys in rank_sets(plant, before.fits, fits, MAX_EFFECTS - len(there))]
    ranked = [keys for keys in ranked if there | set(keys) not in known and not there | set(keys) >= model]
    chosen: list[tuple[str, ...]] = []
    for n in range(2, MAX_EFFECTS - len(there) + 1):
        of_size = [keys for keys in ranked if len(keys) == n]
        chosen += of_size[:N_SETS]
        for key in sorted(model - there):
            chosen += [keys for keys in of_size if key not in keys][:N_SETS]
    return list(dict.fromkeys(chosen))


def _strongest(trials: dict[str, Tried], before: Tried) -> set[str]:
    gains = {key: compare(trial, before).gain for key, trial in trials.items()}
    return set(sorted(gains, key=lambda key: -gains[key])[:N_RIVALS])


def _round(
    plant: Plant, state: State, model: Tried, progress: Progress, only: set[str] | None = None
) -> dict[str, Tried]:
    """Everything that could be added to a model: effects of the library, and nameless terms beside them."""
    state.n_rounds += 1
    number = state.n_rounds

    def suggest(point: Point, blocks: Sequence[int]) -> Sequence[Candidate]:
        everything = [*plant.candidates(point, blocks)]
        if not state.library_only:
            everything += plant.structure(point, blocks)
        return [c for c in everything if only is None or c.key in only]

    trials = fit_with_each(plant, model, suggest, lambda key: progress.pass_by(f"round {number}: {key}"))
    scale = min((t.scale for t in trials.values()), default=1.0)
    for key, trial in trials.items():
        gain = compare(trial, model, scale)
        progress.fitted([c.key for c in trial.accepted], trial.rms, trial.fits[0].point)
        state.tried.append({"name": key, "round": number, "score": gain.gain, "error": gain.error, "rms": trial.rms})
    return trials


def revise(plant: Plant, state: State, progress: Progress) -> None:
    """Look again at each effect beside the later ones: drop what they made superfluous, replace what they unmasked."""
    drop_unneeded(plant, state, progress)
    k = 0
    while k < len(state.model.accepted):
        own = state.model.accepted[k]
        trials, reduced = state.rounds[k]
        is_current = own.key in trials and trials[own.key] is state.model
        if not own.is_structure and not is_current:
            many = bool(trials) and len(reduced.fits[0].free) > MANY
            rivals = _strongest(trials, reduced) if many else None
            trials = _round(plant, state, reduced, progress, rivals)
            again = trials.get(own.key, state.model)
            trials[own.key] = _likelier(again, state.model, by=BETTER)
            best = choose(trials, reduced) or own.key
            if not compare(trials[best], trials[own.key]).is_clear:
                best = own.key
            if trials[best] is not state.model:
                del state.rounds[k]
                state.rounds.append((trials, reduced))
                state.model = trials[best]  # the new one stands last
                drop_unneeded(plant, state, progress)
                continue
        state.rounds[k] = (trials, reduced)
        k += 1


def drop_unneeded(plant: Plant, state: State, progress: Progress) -> None:
    """Leave out, the weakest first, what is not worth it beside the others; note what each that stays is worth."""
    while n := len(state.model.accepted):
        progress(f"without {'each of ' if n > 1 else ''}{n}")
        without = [leave_out(plant, state.model, {k}) for k in range(n)]
        if n == 1:
            state.plain = without[0] = _likelier(without[0], state.plain)
        gains = {
            k: compare(state.model, reduced).gain
            for k, reduced in enumerate(without)
            if not is_worth_it(state.model, reduced)
        }
        if not gains:
            state.rounds = [(trials, reduced) for (trials, _), reduced in zip(state.rounds, without, strict=True)]
            return
        weakest = min(gains, key=lambda k: gains[k])
        state.model = without[weakest]
        del state.rounds[weakest]


def _likelier(one: Tried, other: Tried, by: float = 0.0) -> Tried:
    """One of two fits of one model if held-out parts are likelier under it, `by` nats: dry friction has side minima."""
    return one if compare(one, other).gain > by else other


def leave_out(plant: Plant, model: Tried, out: set[int]) -> Tried:
    """The model without some of its candidates, fitted again."""
    models = [tuple(c for j, c in enumerate(m) if j not in out) for m in model.models]
    base = {f.name for f in plant.base}
    starts = []
    for fitted, m in zip(model.fits, model.models, strict=True):
        point = fitted.point
        for j in out:
            point = _remove(point, m[j], base)
        starts.append([point])
    return fit_model(plant, models, starts)


def _remove(point: Point, candidate: Candidate, base: set[str]) -> Point:
    """The point less what belongs to the candidate (a start may also propose base parameters: these stay)."""
    own = {f.name for f in candidate.free} | {name for start in candidate.starts for name in start}
    return {name: value for name, value in point.items() if name in base or name not in own}
