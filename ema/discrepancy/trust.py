"""How far effects stand out of what is unknown, beside all that could stand in their place."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import norm

from .findings import reject
from .fitting import WILD, Fit
from .form import looks_like, made_by_form
from .free_runs import trust_by_free_runs
from .grade import NAMED
from .plant import Array, Candidate, Free, Plant
from .progress import Progress
from .rounds import State, drop_unneeded, is_explained, judge_model, leave_out
from .selection import Tried, above_noise, compare
from .weighing import Weighed, weigh_sets


def drop_unlikely(plant: Plant, state: State, progress: Progress) -> tuple[dict[str, float], Weighed]:
    """Leave out effects that are no causes: what they explain is a rest without a name. The trust in all.

    These are the unlikeliest together with all that the data cannot tell from them, and, where much stays unexplained,
    those that lean on the bounds of what is credible.
    """
    known: dict[str, float] = {}
    while True:
        weighed = weigh_sets(state.plain, state.model, state.rounds, state.besides)
        trust = _trust(plant, state)
        explained = is_explained(plant, state.plain, state.model)
        odds = {}
        for k, c in enumerate(state.model.accepted):
            if not c.is_structure:
                if not explained and leans_in_a_fold(state.model, k):
                    trust[c.key] = 0.0
                odds[c.key] = trust[c.key] * sum(weighed.instead(c.key).values())
        known.update(trust)
        worst = min(odds, key=lambda key: odds[key], default=None)
        if worst is None or odds[worst] >= NAMED:
            return known, weighed
        progress(f"without {worst}, which is unlikely")
        k = [c.key for c in state.model.accepted].index(worst)
        without = leave_out(plant, state.model, {k})
        state.unlikely.append(_unlikely(worst, odds[worst], without, state.model))
        state.model = without
        del state.rounds[k]
        drop_unneeded(plant, state, progress)


def describe_effects(
    plant: Plant, state: State, trust: dict[str, float], weighed: Weighed, point: Any, draw: Any
) -> list[dict[str, Any]]:
    """The model's effects for findings.json, each with what the data cannot tell from it."""
    named = [c for c in state.model.accepted if not c.is_structure]
    out = []
    for entry in plant.describe(named, point, draw) if named else ():
        key = entry.pop("key")
        instead = {name: trust[key] * p for name, p in weighed.instead(key).items()}
        confidence = instead[key] / (1 + entry.pop("n_equal", 0))
        out.append(
            {
                "name": entry.pop("name"),
                "confidence": round(confidence, 4),
                "of_others": round(sum(instead.values()) - confidence, 4),
                "indistinguishable_from": sorted({*instead, *entry.pop("also", ())} - {key}),
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
    any of them may be what the effect is mistaken for. Of the last, as much as looks like it (`looks_like`), and no
    more than what is left allows. What free runs say against an effect that moves something counts too.
    """
    accepted = state.model.accepted
    terms = {k for k, c in enumerate(accepted) if c.is_structure}
    if len(terms) == len(accepted):
        return {}
    nameless = leave_out(plant, state.model, terms) if terms else state.model
    unknown = 0.0 if judge_model(plant, nameless).is_noise else above_noise(nameless)
    befores = {c.key: of[1] for c, of in zip(accepted, state.rounds, strict=True) if not c.is_structure}
    marks = {key: max(above_noise(before) - above_noise(state.model), 0.0) for key, before in befores.items()}
    made = {key: _differences(before, state.model) for key, before in befores.items()}
    left = _expected_left(state.model, plant.noise_uncertainty)
    trust = {}
    for key, mark in marks.items():
        form = 0.0
        for o in [other for other in marks if other != key]:
            form += made_by_form(looks_like(made[key], made[o]), marks[o], left)
        trust[key] = mark / (mark + unknown + form) if mark > 0.0 else 0.0
    for c in accepted:
        if c.key in trust and not plant.is_of_sensor(c):
            trust[c.key] = trust_by_free_runs(plant, befores[c.key], state.model, trust[c.key])
        if c.key in trust and _leans(state.model.fits[0], c):
            trust[c.key] *= 0.5
    return trust


def _expected_left(model: Tried, noise_uncertainty: float) -> float:
    """Mean square that a model leaves beyond noise, where the noise's amplitude has a relative standard deviation."""
    sd = 2.0 * noise_uncertainty
    if sd == 0.0:
        return above_noise(model)
    z = (model.rms**2 - 1.0) / sd
    return float(sd * (z * norm.cdf(z) + norm.pdf(z)))


def _unlikely(key: str, odds: float, without: Tried, model: Tried) -> dict[str, Any]:
    """What was considered and is less likely than not, for findings.json (`Findings.rejected`)."""
    gain = compare(model, without)
    why = (
        f"held-out parts are {gain.gain:.1f} ± {gain.error:.1f} nats likelier with it, and it is less likely than not "
        f"({odds:.0%}, with all that the data cannot tell from it): what it takes, the form of other laws or what "
        "stays unexplained may make"
    )
    return reject(key, without.rms, model.rms, why)


def _differences(before: Tried, model: Tried) -> list[Array]:
    """What an effect does to each block, beside all that may be fitted in its place."""
    pairs = zip(before.held_out, model.held_out, strict=True)
    return [np.clip(a - b, -WILD, WILD).ravel() for a, b in pairs]
