"""What makes the last effect of a model real: it is credible, and the gain is its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.discrepancy.actuator.fitting.model import CHANCE, DISTANT, Model
from ema.effects import registry

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.candidates import Candidate
    from ema.discrepancy.actuator.fitting.search import Search

SAME = 0.05  # difference in held-out misfit up to which fewer causes are preferred
WORTH_IT = 0.25  # share of what is left that a further effect must take on held-out cycles
ENOUGH = 0.05  # share of what faults alone leave, from which effects explain it but for the form of their laws
OWN_SHARE = 0.5  # of a gain that must go when the effect alone is switched off
ALIKE = 0.6  # share by which two models may leave more or less and be alike: laws are approximations
NOTHING = 3.0  # deviations that simulations of one law have from each other, within which an effect is none
DOUBTFUL = 2.0  # deviations from nothing, below which an effect is not named
SLACK = 0.1  # misfit that switching noise may make


def is_enough(model: Model, before: Model) -> bool:
    """Whether effects explain all but what the form of their laws may leave, which is never far from the data."""
    return bool(model.effects) and model.excess < min(ENOUGH * before.excess + SLACK, DISTANT)


def is_alike(model: Model, best: Model) -> bool:
    """Whether a model leaves little more than the best, or nothing as well."""
    more = SLACK if model.excess < CHANCE else CHANCE
    return model.heldout - best.heldout < ALIKE * best.excess + more


def leaves_noise(search: Search, model: Model) -> bool:
    """Whether what a model leaves is noise. The misfit of noise is not one but where the noise was measured."""
    return max(model.fit.misfit, model.heldout) < 1.0 + SLACK and search.verdict(model).is_noise


def within_reach(best: Model) -> float:
    """Misfit of training cycles up to which a model may turn out to be alike with the best.

    Far from the data first order promises nothing, and nobody is told out of reach by it.
    """
    if best.excess > DISTANT:
        return np.inf
    return best.fit.misfit + ALIKE * max(best.fit.misfit - 1.0, 0.0) + SLACK


def is_something(model: Model, effect: Candidate) -> bool:
    """Whether an effect is larger than that by which honest simulations of one law differ."""
    law = registry()[effect.effect]
    neutral = law.neutral()
    away = {name: abs(model.fit.point[f"{law.name}.{name}"] - neutral[name]) for name in effect.linear}
    return any(x >= NOTHING * law.least_sd.get(name, 0.0) for name, x in away.items())


def is_credible(model: Model) -> bool:
    """Whether the last effect is something, with no parameter driven to what is physically credible at most."""
    if not is_something(model, model.effects[-1]):
        return False
    effect = model.names[-1]
    for p in registry()[effect].parameters:
        x = model.fit.point.get(f"{effect}.{p.name}")
        margin = 1e-3 * (p.high - p.low)
        ends = {p.low, p.high} - {p.neutral, *p.laws_at}
        if x is not None and any(abs(x - end) < margin for end in ends):
            return False
    return True


def does_it(search: Search, model: Model, previous: Model) -> bool:
    """Whether the gain is the effect's own, and not that of faults fitted anew.

    Where only motions of training reach it, as a voltage limit, held-out ones gain by faults that are no longer bent.
    Far from the data, where the noise of another point weighs, only a fit without the effect from there can tell.
    """
    effect = model.effects[-1]
    if search.owed_to(model, effect) > OWN_SHARE * (previous.heldout - model.heldout):
        return True
    gain = previous.fit.misfit - model.fit.misfit
    if gain > CHANCE and search.owed_to(model, effect, in_training=True) > OWN_SHARE * gain:
        return True
    if previous.excess < DISTANT:
        return False
    without = search.without(model, effect)
    return without.excess - model.excess > WORTH_IT * without.excess


def may_be_nothing(search: Search, model: Model, effect: Candidate) -> bool:
    """Whether the intervals of an effect hold nothing at all. Parameters each in doubt may be sure together."""
    names = [f"{effect.effect}.{name}" for name in effect.linear]
    away = (abs(model.fit.point[name] - search.plant.neutral(name)) / max(model.fit.sd[name], 1e-300) for name in names)
    return max(away) <= DOUBTFUL
