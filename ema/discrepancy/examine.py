"""The whole examination: is the residual noise, which effects explain it, what is left, what was gained."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .findings import reject
from .fitting import Fit, fit, flatten, jacobian
from .form import FORM
from .grade import Left, grade
from .held_out import by_record, over_folds, residual_over_folds, training_errors
from .outcome import Outcome
from .plant import Plant
from .progress import Progress
from .rounds import (
    Reread,
    State,
    Together,
    judge_model,
    leave_out,
    never,
    revise,
    select,
    try_library_alone,
    try_sets,
    try_together,
)
from .selection import above_noise, compare, fit_base, is_nameless
from .trust import describe_effects, drop_unlikely
from .weighing import Weighed

MIMICKED = 0.02  # of an effect's mark in power, where less is left of it beside the base parameters it cannot be seen


def examine(
    plant: Plant,
    progress: Progress | None = None,
    reread: Reread | None = None,
    together: Together | None = None,
) -> Outcome:
    """Examine a plant with its records.

    `reread` says where these are to be taken another way (`rounds.State`), `together` which effects to begin with too.
    """
    progress = progress or Progress()
    everything = list(range(len(plant.blocks)))
    progress("nominal model")
    plain = fit_base(plant)
    progress.fitted((), plain.rms, plain.fits[0].point)
    state = State(plain, plain, [], [], reread=reread or never)
    notes: list[str] = []
    select(plant, state, progress)
    revise(plant, state, progress)
    state = try_library_alone(plant, state, progress)
    if together is not None:
        state = try_together(plant, state, together, progress)
    state = try_sets(plant, state, progress)
    trust, weighed = drop_unlikely(plant, state, progress)
    plain = state.plain
    verdict = judge_model(plant, plain)
    left = _without_small_terms(plant, state)
    progress("final fit")
    chosen = list(state.model.accepted)  # where folds suggested different parameters, those of the first fold
    free = [*plant.base, *(f for c in chosen for f in c.free)]
    final = fit(plant, free, state.model.fits[0].point, everything)
    draw = partial(weighed.draw, model=state.model, final=final)
    before = fit(plant, plant.base, plain.fits[0].point, everything)
    terms = [c for c in chosen if c.is_structure]
    outcome = grade(left, named=len(terms) < len(chosen))
    if outcome == "adequate" and not left.is_chance:
        notes.append(
            f"{left.sentence} ({verdict.because}, p = {verdict.p_value:.1g}), and no effect and no term foretells "
            "held-out parts better by what matters: filtered, quantised or held channels can look like this, and so "
            "can something small that is missing"
        )
    if state.immaterial and outcome in ("adequate", "explained"):
        notes.append(f"{state.immaterial}: too little for a cause")
    structure = plant.describe_structure(terms, final.point) if terms or outcome == "unexplained" else {}
    if left.event:
        structure = {**structure, "event": left.event}
    # with terms that have no name, more is told than the verdict asked for
    is_chance = judge_model(plant, state.model).is_noise if terms else left.is_chance
    names = [f.name for f in plant.base]
    return Outcome(
        verdict=outcome,
        because=verdict.because,
        p_value=verdict.p_value,
        effects=describe_effects(plant, state, trust, weighed, final.point, draw),
        structure=structure,
        train=training_errors(plant, plain, state.model),
        folds=over_folds(plant, plain, state.model) if terms else left.error,
        left=left,
        posterior=weighed.described(trust),
        lost=[*state.unlikely, *_lost(state, weighed)],
        base=names,
        k_before=[float(before.point[n]) for n in names],
        k_after=[float(final.point[n]) for n in names],
        records=by_record(plant, plain, state.model),
        tried=state.tried,
        mimicked=_mimicked(plant, final) if not chosen else (),
        k_error=tuple(np.sqrt(np.diag(final.covariance))[: len(names)].tolist()),
        point=final.point,
        model=state.model,
        notes=notes,
        rest=0.0 if is_chance else state.model.rms,
    )


def _lost(state: State, weighed: Weighed) -> list[dict[str, Any]]:
    """Effects of the library that were tried in the place of one that is named, gain by more than chance, and lost."""
    rows: dict[str, dict[str, Any]] = {}
    for own, (trials, before) in zip(state.model.accepted, state.rounds, strict=True):
        if not trials:  # a term without a name, of a set that was fitted as a whole
            continue
        scale = min(t.scale for t in trials.values())
        told = {*weighed.instead(own.key), *(c.key for c in state.model.accepted)}
        for key, trial in trials.items():
            if key in told or is_nameless(key, trial) or not compare(trial, before, scale).is_significant:
                continue
            lead = compare(trials[own.key], trial, scale)
            why = (
                f"{lead.gain:.1f} ± {lead.error:.1f} nats behind {own.key} by what held-out parts say; in its place "
                f"leaves {trial.rms:.3g} of them where noise is 1; {own.key}: {trials[own.key].rms:.3g}"
            )
            row = reject(key, before.rms, trial.rms, why, (lead.gain, lead.error), "held-out parts")
            if key not in rows or lead.gain < rows[key]["nats"]:
                rows[key] = row
    return sorted(rows.values(), key=lambda row: row["nats"])


def _without_small_terms(plant: Plant, state: State) -> Left:
    """What named causes alone leave; where that is no more than noise may, terms without a name are left out."""
    terms = {k for k, c in enumerate(state.model.accepted) if c.is_structure}
    named = leave_out(plant, state.model, terms) if terms else state.model
    left = Left(
        judge_model(plant, named).is_noise,
        over_folds(plant, state.plain, named),
        residual_over_folds(plant, state.plain, named),
        above_noise(named) < FORM**2 * above_noise(state.plain),
        plant.noise_uncertainty,
    )
    if terms and grade(left, named=bool(named.accepted)) in ("adequate", "explained"):
        keys = " and ".join(state.model.accepted[k].key for k in sorted(terms))
        mark = above_noise(named) - above_noise(state.model)
        state.immaterial = f"{keys} would take {mark:.1%} of the noise's mean square from it"
        state.rounds = [of for k, of in enumerate(state.rounds) if k not in terms]
        state.model = named
    return left


def _mimicked(plant: Plant, model: Fit) -> tuple[str, ...]:
    """Effects whose mark on the residual the base parameters could have made: the records cannot show them."""
    here = flatten(model.residuals)
    slopes, _ = np.linalg.qr(jacobian(plant, plant.base, model.point, model.blocks, here))
    out = []
    for candidate in plant.candidates(model.point, model.blocks):
        points = [{**model.point, **start} for start in candidate.starts[:1]]
        mark = flatten(plant.residuals(points, model.blocks)[0]) - here
        left = mark - slopes @ (slopes.T @ mark)
        if left @ left < MIMICKED * (mark @ mark):
            out.append(candidate.effect)
    return tuple(dict.fromkeys(out))
