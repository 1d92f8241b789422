"""How far effects stand out of what is unknown, beside all that could stand in their place."""

from __future__ import annotations

from typing import Any

import numpy as np

from .fitting import Fit
from .plant import Candidate, Free, Plant
from .progress import Progress
from .rounds import State, is_explained, judged, leave_out
from .selection import FORM, Tried, above_noise, alike, best_of, compare, is_nameless

UNLIKELY = 0.1  # odds of an effect with all that the data cannot tell from it, below which it is not named


def without_unlikely(plant: Plant, state: State, progress: Progress) -> dict[str, float]:
    """Leave out effects that are no causes: what they explain is a rest without a name. The trust in those that stay.

    These are the unlikeliest together with all that the data cannot tell from them, and, where much stays unexplained,
    those that lean on the bounds of what is credible.
    """
    while True:
        trust = _trust(plant, state)
        explained = is_explained(plant, state.plain, state.model)
        odds = {}
        for k, (c, (trials, before)) in enumerate(zip(state.model.accepted, state.rounds, strict=True)):
            if not c.is_structure:
                weights = _weights(trials, before)
                told = {c.key, *(key for key in alike(trials, c.key, before) if key in weights)}
                no_cause = not explained and leans_in_a_fold(state.model, k)
                odds[c.key] = 0.0 if no_cause else trust[c.key] * sum(weights[key] for key in told)
        worst = min(odds, key=lambda key: odds[key], default=None)
        if worst is None or odds[worst] >= UNLIKELY:
            return trust
        progress(f"without {worst}, which is unlikely")
        k = [c.key for c in state.model.accepted].index(worst)
        state.model = leave_out(plant, state.model, {k})
        del state.rounds[k]


def told_effects(plant: Plant, state: State, trust: dict[str, float], point: Any, draw: Any) -> list[dict[str, Any]]:
    """The model's effects for findings.json, each with what the data cannot tell from it."""
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


def leans_in_a_fold(model: Tried, k: int) -> bool:
    """Whether the k-th law leans on its bounds; folds may have it with other parameters, as lines of another order."""
    return any(_leans(fitted, own[k]) for fitted, own in zip(model.fits, model.models, strict=True))


def _leans(fitted: Fit, candidate: Candidate) -> bool:
    """Whether a law leans on its bounds: then it is not the one that is missing."""
    return any(at_bound(f, fitted.point[f.name]) for f in candidate.free if not f.is_shape)


def at_bound(free: Free, value: float) -> bool:
    """Whether a fitted value leans on its bound, other than the one that switches the effect off."""
    near = 1e-3 * (free.high - free.low)
    return value > free.high - near or (value < free.low + near and free.low != 0.0)


def _trust(plant: Plant, state: State) -> dict[str, float]:
    """How far each effect stands out of what is unknown.

    The mark of an effect is what the mean square of the held-out residual loses by it. Beside it stand what is left
    unexplained, what only nameless terms explain, and what the other effects' laws may miss by having the wrong form:
    any of them may be what the effect is mistaken for.
    """
    accepted = state.model.accepted
    terms = {k for k, c in enumerate(accepted) if c.is_structure}
    if len(terms) == len(accepted):
        return {}
    nameless = leave_out(plant, state.model, terms) if terms else state.model
    unknown = 0.0 if judged(plant, nameless).is_noise else above_noise(nameless)
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
