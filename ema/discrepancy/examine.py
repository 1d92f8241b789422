"""The whole examination: is the residual noise, which effects explain it, what is left, what was gained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from .fitting import fit
from .outcome import Gain, Outcome, RecordGain
from .plant import Candidate, Errors, Plant, Point
from .selection import (
    Progress,
    Tried,
    above_noise,
    alike,
    base_model,
    best_of,
    compare,
    fit_model,
    is_worth_it,
    one_more,
    silent,
    training,
)
from .verdict import Verdict, judge

MAX_EFFECTS = 3
MAX_TERMS = 3
EXPLAINED = 1.2  # held-out residual over noise up to which a model counts as explaining the data
LITTLE_LEFT = 0.03  # or share of the residual above noise that may be left
MIN_EXPLAINED_SHARE = 0.5  # of the residual above noise: a cause that explains less is not trusted


@dataclass
class _State:
    """Model so far, and for each accepted effect the trials of its round and the model before it."""

    model: Tried
    rounds: dict[str, tuple[dict[str, Tried], Tried]]
    tried: list[dict[str, Any]]


def examine(plant: Plant, progress: Progress = silent) -> Outcome:
    """Examine a plant with its records."""
    everything = list(range(len(plant.blocks)))
    progress("nominal model")
    plain = base_model(plant)
    verdict = _judged(plant, plain)
    state = _State(plain, {}, [])
    if not verdict.is_noise:
        _select(plant, state, plant.candidates, MAX_EFFECTS, progress)
        if not _is_explained(plant, plain, state.model):
            _select(plant, state, plant.structure, MAX_EFFECTS + MAX_TERMS, progress)
        _drop_superfluous(plant, state, progress)
    progress("final fit")
    chosen = _union(state.model)
    free = [*plant.base, *(f for c in chosen for f in c.free)]
    final = fit(plant, free, state.model.fits[0].point, everything)
    before = fit(plant, plant.base, plain.fits[0].point, everything)
    explained = _is_explained(plant, plain, state.model)
    named = [c for c in chosen if not c.is_structure]
    terms = [c for c in chosen if c.is_structure]
    share = 1.0 - above_noise(state.model) / max(above_noise(plain), 1e-12)
    notes: list[str] = []
    trust = 1.0 if explained else min(1.0, share / MIN_EXPLAINED_SHARE)
    if named and trust < 1.0:
        notes.append(f"{', '.join(c.key for c in named)}: explain only {share:.0%} of the residual above noise")
    outcome: Any = "adequate" if verdict.is_noise else ("explained" if explained and not terms else "unexplained")
    names = [f.name for f in plant.base]
    return Outcome(
        verdict=outcome,
        because=verdict.because,
        p_value=verdict.p_value,
        effects=_effects(plant, state, named, final.point, final.draw, trust),
        structure=_structure(plant, terms, final.point) if outcome == "unexplained" else {},
        train=_gain(plant, plain, state.model, held_out=False),
        heldout=_gain(plant, plain, state.model, held_out=True),
        base=names,
        k_before=[float(before.point[n]) for n in names],
        k_after=[float(final.point[n]) for n in names],
        records=_records(plant, plain, state.model),
        tried=state.tried,
        point=final.point,
        notes=notes,
    )


def _is_explained(plant: Plant, plain: Tried, model: Tried) -> bool:
    if model.rms <= EXPLAINED:
        return True
    if above_noise(model) < LITTLE_LEFT * above_noise(plain):
        return True
    return _judged(plant, model).is_noise


def _judged(plant: Plant, model: Tried) -> Verdict:
    n_free = sum(len(f.free) for f in model.fits)
    return judge(model.held_out, noise_uncertainty=plant.noise_uncertainty, n_free=n_free)


def _select(plant: Plant, state: _State, suggest: Any, limit: int, progress: Progress) -> None:
    """Forward selection until the residual is noise, nothing helps, or `limit` kinds are in the model."""
    while not _judged(plant, state.model).is_noise:
        kinds = {c.effect for c in state.model.accepted}
        trials = one_more(plant, state.model, suggest, partial(_round, progress, len(state.rounds) + 1))
        if not trials:
            return
        scale = min(t.scale for t in trials.values())
        for key, trial in trials.items():
            gain = compare(trial, state.model, scale)
            entry = {"name": key, "round": len(state.rounds) + 1, "score": gain.gain, "error": gain.error}
            state.tried.append({**entry, "rms": trial.rms})
        best = best_of(trials, state.model)
        candidate = trials[best].accepted[-1]
        if candidate.effect not in kinds and len(kinds) >= limit:
            return
        if not is_worth_it(trials[best], state.model):
            return
        state.rounds[f"{best}/{len(state.rounds)}"] = (trials, state.model)
        state.model = trials[best]


def _drop_superfluous(plant: Plant, state: _State, progress: Progress) -> None:
    """Take out what later additions have made superfluous."""
    k = 0
    while len(state.model.accepted) > 1 and k < len(state.model.accepted):
        progress(f"without {state.model.accepted[k].key}")
        models = [m[:k] + m[k + 1 :] for m in state.model.models]
        base = {f.name for f in plant.base}
        starts = [[_without(f.point, m[k], base)] for f, m in zip(state.model.fits, state.model.models, strict=True)]
        reduced = fit_model(plant, models, starts)
        if is_worth_it(state.model, reduced):
            k += 1
        else:
            state.model = reduced
            del state.rounds[list(state.rounds)[k]]


def _round(progress: Progress, number: int, key: str) -> None:
    progress(f"round {number}: {key}")


def _without(point: Point, candidate: Candidate, base: set[str]) -> Point:
    """The point less what belongs to the candidate (a start may also propose base parameters: these stay)."""
    own = {f.name for f in candidate.free} | {name for start in candidate.starts for name in start}
    return {name: value for name, value in point.items() if name in base or name not in own}


def _union(model: Tried) -> list[Candidate]:
    """Candidates of the model; where folds suggested different parameters, those of the first fold."""
    return list(model.accepted)


def _effects(
    plant: Plant, state: _State, named: Sequence[Candidate], point: Any, draw: Any, trust: float
) -> list[dict[str, Any]]:
    described = plant.describe(named, point, draw)
    out = []
    rounds = {name.split("/")[0]: value for name, value in reversed(state.rounds.items())}
    for entry in described:
        key = entry.pop("key")
        trials, before = rounds[key]
        others = alike(trials, key, before)
        weights = _weights(trials, before)
        confidence = weights[key] * trust
        out.append(
            {
                "name": entry.pop("name"),
                "confidence": round(confidence, 4),
                "indistinguishable_from": sorted(o for o in others if not trials[o].accepted[-1].is_structure),
                **entry,
            }
        )
    return out


def _weights(trials: dict[str, Tried], before: Tried) -> dict[str, float]:
    """Share of each explanation in the likelihood of held-out data; gains count no more than their error allows."""
    scale = min(t.scale for t in trials.values())
    best = best_of(trials, before)
    logs = {}
    for key, trial in trials.items():
        lead = compare(trials[best], trial, scale)
        logs[key] = -lead.gain / max(1.0, lead.error / 5.0)
    total = sum(np.exp(v) for v in logs.values())
    return {key: float(np.exp(v) / total) for key, v in logs.items()}


def _structure(plant: Plant, terms: Sequence[Candidate], point: Any) -> dict[str, Any]:
    return plant.describe_structure(terms, point)


def _gain(plant: Plant, plain: Tried, model: Tried, *, held_out: bool) -> Gain:
    parts = [out if held_out else train for train, out in training(plant)]
    rows: list[tuple[Errors, Errors]] = [
        (plant.errors(a.point, blocks), plant.errors(b.point, blocks))
        for a, b, blocks in zip(plain.fits, model.fits, parts, strict=True)
    ]
    mean = [
        float(np.sqrt(np.mean([getattr(e, name) ** 2 for e in side])))
        for side, name in (
            ([r[0] for r in rows], "error"),
            ([r[1] for r in rows], "error"),
            ([r[1] for r in rows], "noise_floor"),
        )
    ]
    return Gain(*mean)


def _records(plant: Plant, plain: Tried, model: Tried) -> list[RecordGain]:
    out = []
    for group in dict.fromkeys(b.group for b in plant.blocks):
        mine = {j for j, b in enumerate(plant.blocks) if b.group == group}
        before, after = [], []
        for (_, left_out), a, b in zip(training(plant), plain.fits, model.fits, strict=True):
            blocks = [j for j in left_out if j in mine]
            if blocks:
                before.append(plant.errors(a.point, blocks))
                after.append(plant.errors(b.point, blocks))
        pooled = [
            float(np.sqrt(np.mean(np.square(x))))
            for x in ([e.error for e in before], [e.error for e in after], [e.noise_floor for e in after])
        ]
        rms = [replace(t, held_out=tuple(t.held_out[j] for j in sorted(mine))).rms for t in (plain, model)]
        out.append(RecordGain(group, *pooled, *rms))
    return out
