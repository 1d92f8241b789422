"""The whole examination: is the residual noise, which effects explain it, what is left, what was gained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .fitting import Fit, fit, jacobian
from .grade import LIMIT, Left, graded
from .held_out import by_record, over_folds, residual_over_folds, training_gain
from .outcome import Gain, Outcome
from .plant import Candidate, Free, Plant, Point
from .progress import Progress
from .selection import (
    FORM,
    Tried,
    above_noise,
    alike,
    base_model,
    best_of,
    choice,
    compare,
    fit_model,
    is_nameless,
    is_worth_it,
    one_more,
)
from .verdict import Verdict, judge

MAX_EFFECTS = 3
MAX_TERMS = 3
MAX_ADDED = 5  # of both kinds, further lines of a kind that is there already counted too
IMMATERIAL = 0.01  # of the noise's mean square: what takes less is told, and no cause: no plant file is that exact
MANY = 12  # free parameters from which an effect is revised beside its strongest rivals only
N_RIVALS = 6
UNLIKELY = 0.1  # odds of an effect with all that the data cannot tell from it, below which it is not named
MIMICKED = 0.02  # of an effect's mark in power, where less is left of it beside the base parameters it cannot be seen


@dataclass
class _State:
    """Models without effects and so far, and for each accepted effect the trials in its place and the model without."""

    plain: Tried
    model: Tried
    rounds: list[tuple[dict[str, Tried], Tried]]
    tried: list[dict[str, Any]]
    n_rounds: int = 0
    library_only: bool = False  # no nameless terms
    immaterial: str = ""  # what ended the selection by taking less than matters


def examine(plant: Plant, progress: Progress | None = None) -> Outcome:
    """Examine a plant with its records."""
    progress = progress or Progress()
    everything = list(range(len(plant.blocks)))
    progress("nominal model")
    plain = base_model(plant)
    progress.fitted((), plain.rms, plain.fits[0].point)
    state = _State(plain, plain, [], [])
    notes: list[str] = []
    _select(plant, state, progress)
    _revise(plant, state, progress)
    state = _without_terms(plant, state, progress)
    trust = _without_unlikely(plant, state, progress)
    plain = state.plain
    verdict = _judged(plant, plain)
    left = _without_small_terms(plant, state)
    progress("final fit")
    chosen = list(state.model.accepted)  # where folds suggested different parameters, those of the first fold
    free = [*plant.base, *(f for c in chosen for f in c.free)]
    final = fit(plant, free, state.model.fits[0].point, everything)
    before = fit(plant, plant.base, plain.fits[0].point, everything)
    terms = [c for c in chosen if c.is_structure]
    outcome = graded(left, named=len(terms) < len(chosen))
    if outcome == "adequate" and not left.is_chance:
        notes.append(
            f"{left.sentence} ({verdict.because}, p = {verdict.p_value:.1g}), and no effect and no term foretells "
            "held-out parts better by what matters: filtered, quantised or held channels can look like this, and so "
            "can something small that is missing"
        )
    if state.immaterial and outcome in ("adequate", "explained"):
        notes.append(f"{state.immaterial}: too little for a cause")
    last = _judged(plant, state.model)
    folds = over_folds(plant, plain, state.model)
    names = [f.name for f in plant.base]
    return Outcome(
        verdict=outcome,
        because=verdict.because,
        p_value=verdict.p_value,
        effects=_effects(plant, state, trust, final.point, final.draw),
        structure=plant.describe_structure(terms, final.point) if terms or outcome == "unexplained" else {},
        train=training_gain(plant, plain, state.model),
        heldout=Gain(folds.err_before, folds.err_after, folds.noise_floor),
        folds=folds,
        left=left,
        lost=_lost(state),
        base=names,
        k_before=[float(before.point[n]) for n in names],
        k_after=[float(final.point[n]) for n in names],
        records=by_record(plant, plain, state.model),
        tried=state.tried,
        mimicked=_mimicked(plant, final) if not chosen else (),
        k_error=tuple(np.sqrt(np.diag(final.covariance))[: len(names)].tolist()),
        point=final.point,
        notes=notes,
        rest=0.0 if last.is_noise else state.model.rms,
    )


def _lost(state: _State) -> list[dict[str, Any]]:
    """Effects of the library that were tried in the place of one that is named, gain by more than chance, and lost."""
    rows: dict[str, dict[str, Any]] = {}
    for own, (trials, before) in zip(state.model.accepted, state.rounds, strict=True):
        scale = min(t.scale for t in trials.values())
        told = {own.key, *alike(trials, own.key, before), *(c.key for c in state.model.accepted)}
        for key, trial in trials.items():
            if key in told or is_nameless(key, trial) or not compare(trial, before, scale).is_significant:
                continue
            lead = compare(trials[own.key], trial, scale)
            why = (
                f"{lead.gain:.1f} ± {lead.error:.1f} nats behind {own.key} by what held-out parts say; in its place "
                f"leaves {trial.rms:.3g} of them where noise is 1; {own.key}: {trials[own.key].rms:.3g}"
            )
            row = {"name": key, "before": before.rms, "after": trial.rms, "nats": lead.gain, "nats_error": lead.error,
                   "nats_of": "held-out parts", "why": why}  # fmt: skip
            if key not in rows or lead.gain < rows[key]["nats"]:
                rows[key] = row
    return sorted(rows.values(), key=lambda row: row["nats"])


def _without_small_terms(plant: Plant, state: _State) -> Left:
    """What named causes alone leave; where that is no more than noise may, terms without a name are left out."""
    terms = {k for k, c in enumerate(state.model.accepted) if c.is_structure}
    named = _leave_out(plant, state.model, terms) if terms else state.model
    left = Left(
        _judged(plant, named).is_noise,
        over_folds(plant, state.plain, named),
        residual_over_folds(plant, state.plain, named),
        above_noise(named) < FORM**2 * above_noise(state.plain),
        plant.noise_uncertainty,
    )
    if terms and graded(left, named=bool(named.accepted)) in ("adequate", "explained"):
        keys = " and ".join(state.model.accepted[k].key for k in sorted(terms))
        mark = above_noise(named) - above_noise(state.model)
        state.immaterial = f"{keys} would take {mark:.1%} of the noise's mean square from it"
        state.rounds = [of for k, of in enumerate(state.rounds) if k not in terms]
        state.model = named
    return left


def _mimicked(plant: Plant, model: Fit) -> tuple[str, ...]:
    """Effects whose mark on the residual the base parameters could have made: the records cannot show them."""
    here = np.concatenate([r.ravel() for r in model.residuals])
    slopes, _ = np.linalg.qr(jacobian(plant, plant.base, model.point, model.blocks, here))
    out = []
    for candidate in plant.candidates(model.point, model.blocks):
        points = [{**model.point, **start} for start in candidate.starts[:1]]
        mark = np.concatenate([r.ravel() for r in plant.residuals(points, model.blocks)[0]]) - here
        left = mark - slopes @ (slopes.T @ mark)
        if left @ left < MIMICKED * (mark @ mark):
            out.append(candidate.key)
    return tuple(out)


def _is_explained(plant: Plant, plain: Tried, model: Tried) -> bool:
    """Noise is left, or little more, or what the wrong form of the laws found may leave."""
    if model.rms <= LIMIT:
        return True
    if above_noise(model) < FORM**2 * above_noise(plain):
        return True
    return _judged(plant, model).is_noise


def _judged(plant: Plant, model: Tried) -> Verdict:
    n_free = sum(len(f.free) for f in model.fits)
    return judge(model.held_out, noise_uncertainty=plant.noise_uncertainty, n_free=n_free)


def _select(plant: Plant, state: _State, progress: Progress) -> None:
    """Forward selection until the residual is noise, nothing helps, or enough kinds are in the model.

    Dry friction has side minima: where the model does as well without an effect, begun where the fit with it ended, the
    gain was not the effect's own.
    """
    begun_anew_with = -1  # effects
    while not _judged(plant, state.model).is_noise:
        trials = _round(plant, state, state.model, progress)
        best = choice(trials, state.model) if trials else None
        if best is None or not is_worth_it(trials[best], state.model):
            return
        candidate = trials[best].accepted[-1]
        if candidate.is_structure and _is_explained(plant, state.plain, state.model):
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
        again = _leave_out(plant, trials[best], {n})
        if compare(again, state.model).gain > 0.0 and not is_worth_it(trials[best], again):
            if n == begun_anew_with:
                return
            begun_anew_with = n
            state.model, state.plain = again, again if n == 0 else state.plain
            continue
        state.rounds.append((trials, state.model))
        state.model = trials[best]


def _without_terms(plant: Plant, state: _State, progress: Progress) -> _State:
    """Effects of the library alone, where they foretell held-out parts as well as with nameless terms.

    One term may do what two effects do: friction that knows directions beside a spring is a force along the travel.
    """
    if not any(c.is_structure for c in state.model.accepted):
        return state
    progress("effects of the library alone")
    other = _State(state.plain, state.plain, [], state.tried, state.n_rounds, library_only=True)
    _select(plant, other, progress)
    _revise(plant, other, progress)
    few = len(other.model.accepted) <= len(state.model.accepted) + 1
    as_well = _is_explained(plant, other.plain, other.model) and not compare(state.model, other.model).is_clear
    return other if few and as_well else state


def _strongest(trials: dict[str, Tried], before: Tried) -> set[str]:
    gains = {key: compare(trial, before).gain for key, trial in trials.items()}
    return set(sorted(gains, key=lambda key: -gains[key])[:N_RIVALS])


def _round(
    plant: Plant, state: _State, model: Tried, progress: Progress, only: set[str] | None = None
) -> dict[str, Tried]:
    """Everything that could be added to a model: effects of the library, and nameless terms beside them."""
    state.n_rounds += 1
    number = state.n_rounds

    def suggest(point: Point, blocks: Sequence[int]) -> Sequence[Candidate]:
        everything = [*plant.candidates(point, blocks)]
        if not state.library_only:
            everything += plant.structure(point, blocks)
        return [c for c in everything if only is None or c.key in only]

    trials = one_more(plant, model, suggest, lambda key: progress(f"round {number}: {key}"))
    scale = min((t.scale for t in trials.values()), default=1.0)
    for key, trial in trials.items():
        gain = compare(trial, model, scale)
        progress.fitted([c.key for c in trial.accepted], trial.rms, trial.fits[0].point)
        state.tried.append({"name": key, "round": number, "score": gain.gain, "error": gain.error, "rms": trial.rms})
    return trials


def _revise(plant: Plant, state: _State, progress: Progress) -> None:
    """Look again at each effect beside the later ones: drop what they made superfluous, replace what they unmasked."""
    k = 0
    while len(state.model.accepted) > 1 and k < len(state.model.accepted):
        own = state.model.accepted[k]
        progress(f"without {own.key}")
        reduced = _leave_out(plant, state.model, {k})
        if not is_worth_it(state.model, reduced):
            state.model = reduced
            del state.rounds[k]
            continue
        last = k == len(state.model.accepted) - 1
        if own.is_structure or last:
            state.rounds[k] = (state.rounds[k][0], reduced)
            k += 1
            continue
        many = len(reduced.fits[0].free) > MANY
        rivals = _strongest(state.rounds[k][0], state.rounds[k][1]) if many else None
        trials = _round(plant, state, reduced, progress, rivals)
        trials[own.key] = state.model
        best = choice(trials, reduced) or own.key
        if best != own.key and compare(trials[best], state.model).is_clear:
            model = trials[best]
            del state.rounds[k]
            state.rounds.append((trials, reduced))
            state.model = model  # the new one stands last
            k += 1
            continue
        state.rounds[k] = (trials, reduced)
        k += 1


def _leave_out(plant: Plant, model: Tried, out: set[int]) -> Tried:
    """The model without some of its candidates, fitted again."""
    models = [tuple(c for j, c in enumerate(m) if j not in out) for m in model.models]
    base = {f.name for f in plant.base}
    starts = []
    for fitted, m in zip(model.fits, model.models, strict=True):
        point = fitted.point
        for j in out:
            point = _without(point, m[j], base)
        starts.append([point])
    return fit_model(plant, models, starts)


def _without(point: Point, candidate: Candidate, base: set[str]) -> Point:
    """The point less what belongs to the candidate (a start may also propose base parameters: these stay)."""
    own = {f.name for f in candidate.free} | {name for start in candidate.starts for name in start}
    return {name: value for name, value in point.items() if name in base or name not in own}


def _without_unlikely(plant: Plant, state: _State, progress: Progress) -> dict[str, float]:
    """Leave out effects that are no causes: what they explain is a rest without a name. The trust in those that stay.

    These are the unlikeliest together with all that the data cannot tell from them, and, where much stays unexplained,
    those that lean on the bounds of what is credible.
    """
    while True:
        trust = _trust(plant, state)
        explained = _is_explained(plant, state.plain, state.model)
        odds = {}
        for c, (trials, before) in zip(state.model.accepted, state.rounds, strict=True):
            if not c.is_structure:
                weights = _weights(trials, before)
                told = {c.key, *(key for key in alike(trials, c.key, before) if key in weights)}
                no_cause = not explained and any(_leans(fitted, c) for fitted in state.model.fits)
                odds[c.key] = 0.0 if no_cause else trust[c.key] * sum(weights[key] for key in told)
        worst = min(odds, key=lambda key: odds[key], default=None)
        if worst is None or odds[worst] >= UNLIKELY:
            return trust
        progress(f"without {worst}, which is unlikely")
        k = [c.key for c in state.model.accepted].index(worst)
        state.model = _leave_out(plant, state.model, {k})
        del state.rounds[k]


def _effects(plant: Plant, state: _State, trust: dict[str, float], point: Any, draw: Any) -> list[dict[str, Any]]:
    accepted = state.model.accepted
    named = [c for c in accepted if not c.is_structure]
    if not named:
        return []
    rounds = dict(zip((c.key for c in accepted), state.rounds, strict=True))
    out = []
    for entry in plant.describe(named, point, draw):
        key = entry.pop("key")
        trials, before = rounds[key]
        others = {o for o in alike(trials, key, before) if not is_nameless(o, trials[o])}
        others |= set(entry.pop("also", ()))
        confidence = _weights(trials, before)[key] * trust[key] / (1 + entry.pop("n_equal", 0))
        out.append(
            {
                "name": entry.pop("name"),
                "confidence": round(confidence, 4),
                "indistinguishable_from": sorted(others),
                **entry,
            }
        )
    return out


def _leans(fitted: Fit, candidate: Candidate) -> bool:
    """Whether a law leans on its bounds: then it is not the one that is missing."""
    return any(at_bound(f, fitted.point[f.name]) for f in candidate.free if not f.is_shape)


def at_bound(free: Free, value: float) -> bool:
    """Whether a fitted value leans on its bound, other than the one that switches the effect off."""
    near = 1e-3 * (free.high - free.low)
    return value > free.high - near or (value < free.low + near and free.low != 0.0)


def _trust(plant: Plant, state: _State) -> dict[str, float]:
    """How far each effect stands out of what is unknown.

    The mark of an effect is what the mean square of the held-out residual loses by it. Beside it stand what is left
    unexplained, what only nameless terms explain, and what the other effects' laws may miss by having the wrong form:
    any of them may be what the effect is mistaken for.
    """
    accepted = state.model.accepted
    terms = {k for k, c in enumerate(accepted) if c.is_structure}
    if len(terms) == len(accepted):
        return {}
    nameless = _leave_out(plant, state.model, terms) if terms else state.model
    unknown = 0.0 if _judged(plant, nameless).is_noise else above_noise(nameless)
    marks = {
        c.key: max(above_noise(before) - above_noise(state.model), 0.0)
        for c, (_, before) in zip(accepted, state.rounds, strict=True)
        if not c.is_structure
    }
    trust = {}
    for key, mark in marks.items():
        others = sum(marks.values()) - mark
        trust[key] = mark / (mark + unknown + FORM**2 * others) if mark > 0.0 else 0.0
    for c in accepted:
        if c.key in trust and _leans(state.model.fits[0], c):
            trust[c.key] *= 0.5
    return trust


def _weights(trials: dict[str, Tried], before: Tried) -> dict[str, float]:
    """Share of each effect in the likelihood of held-out data; gains count no more than their error allows."""
    trials = {key: t for key, t in trials.items() if not is_nameless(key, t)}
    scale = min(t.scale for t in trials.values())
    best = best_of(trials, before)
    logs = {}
    for key, trial in trials.items():
        lead = compare(trials[best], trial, scale)
        logs[key] = -lead.gain / max(1.0, lead.error / 5.0)
    total = sum(np.exp(v) for v in logs.values())
    return {key: float(np.exp(v) / total) for key, v in logs.items()}
