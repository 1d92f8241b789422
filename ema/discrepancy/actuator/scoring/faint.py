"""Effects too faint for a test of all that is left, or for a search: the score knows what each would do."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.core.records import Array
from ema.discrepancy.actuator.finding.screening import Screened, columns_of, rank_to_first_order
from ema.discrepancy.actuator.finding.weighing import is_credible
from ema.discrepancy.actuator.fitting.candidates import Way
from ema.discrepancy.actuator.fitting.fit import stacked_jacobian
from ema.discrepancy.actuator.fitting.model import NEAR, Model, ways_of
from ema.discrepancy.actuator.fitting.problem import as_cause, cost_of
from ema.discrepancy.actuator.simulating.noise import Verdict
from ema.discrepancy.engine.contest import BEHIND, Outcome
from ema.discrepancy.grade import IN_SET, NAMED

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

N_FITTED = 6  # likeliest effects that are fitted beside nothing; of one that may act in two ways, both
N_RIVALS = 3  # the same beside or in the place of what was found
SURE = 0.95  # probability that something is there, from which a record that leaves about noise is not adequate
LEAST = float(np.log(SURE / (1.0 - SURE)))  # [nats] that an effect must promise, else it cannot make sure


def fit_rivals(search: Search, answer: Model, weighed: Sequence[Model]) -> list[Model]:
    """What may be in the place of an effect of `answer` without which about noise is left; and has not been `weighed`.

    A search that has found what leaves noise asks no others but what resembles it: in the place of drag by the square
    of the speed, beside a viscous one, stood Stribeck friction.
    """
    smaller = [m for m in weighed if len(m.names) == len(answer.names) - 1 and set(m.names) < set(answer.names)]
    known = {ways_of(m) for m in weighed}
    near = [m for m in {m.names: m for m in reversed(smaller)}.values() if m.excess < NEAR]
    return [rival for m in near for rival in fit_faint_effects(search, m, N_RIVALS, 0.0, known)]


def fit_faint_effects(
    search: Search, model: Model, n: int, least: float = LEAST, known: Container[frozenset[Way]] = ()
) -> list[Model]:
    """`model` with one effect each that promises, to first order, `least` nats beyond its cost; the likeliest `n`.

    Sets of ways to act that are `known` are passed over, and what promises far less than the likeliest.

    A test of squares asks whether anything is left along thousands of features. A clock that is 0.07 % off leaves 1.3
    times what noise does there, which may be chance, and at its minimum is sixty nats likelier than none.
    """
    own = stacked_jacobian(search.noise, model.fit.free, model.fit.columns, search.train)
    nats: dict[Way, tuple[float, Screened]] = {}
    for s in rank_to_first_order(search, model):
        way = s.candidate.way
        if ways_of(model) | {way} in known:
            continue
        gain = 0.5 * (model.fit.cost - s.promised) - _cost_to_first_order(search, own, s)
        if gain > max(least, nats.get(way, (least, s))[0]):
            nats[way] = gain, s
    best: dict[str, Model] = {}
    top = max((gain for gain, _ in nats.values()), default=0.0)
    near = [(gain, s) for gain, s in nats.values() if gain > top - BEHIND]
    for _, s in sorted(near, key=lambda of: -of[0])[:n]:
        frees = (*model.fit.free, *s.candidate.frees)
        m = search.model((*model.effects, s.candidate), frees, s.start, None, 4)
        best[s.candidate.effect] = min(m, best.get(s.candidate.effect, m), key=lambda m: m.fit.misfit)
    return list(best.values())


def _cost_to_first_order(search: Search, own: Array, s: Screened) -> float:
    """What a candidate costs beside the columns `own` of a model, whitened, shape (n, n_free). [nats]"""
    J = np.concatenate([own, columns_of(search, s.candidate)], axis=1)
    sd = np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))[own.shape[1] :]
    names = (f"{s.candidate.effect}.{name}" for name in s.candidate.linear)
    usual = {p.name: p.usual for p in as_cause(s.candidate).parameters}
    return cost_of(s.candidate, {**usual, **dict(zip(names, sd.tolist(), strict=False))})


def may_hide_something(model: Model, v: Verdict) -> bool:
    """Whether what is left is noise or near it, and one more effect may be there: the score is to say then."""
    return not model.is_full and (v.is_noise or model.excess < NEAR)


def hear(outcome: Outcome, models: list[Model], found: Model) -> tuple[Model, tuple[str, ...]] | None:
    """The likeliest model of one effect more than `found` and the others that it may be, where that is likely enough.

    That anything is missing has to be sure. Beside what is missing a further cause is told as every other is.
    """
    names = set(found.names)
    enough = NAMED if names else SURE
    more = {e.causes: e.probability for e in outcome.posterior if names < set(e.causes)}
    first = next((m for m in models if names < set(m.names) and len(m.names) == len(names) + 1), None)
    if first is None or sum(more.values()) < enough or not is_credible(first):
        return None
    others = [(set(of) - names, p) for of, p in more.items() if len(of) == len(first.names)]
    return first, tuple(name for new, p in others for name in new - set(first.names) if p >= IN_SET)
