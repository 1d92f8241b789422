"""One effect in place of what several faults have in common."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .candidates import Candidate, candidates
from .fit import Free
from .plant import Point
from .resembling import looking_like
from .screening import probed, promising, start_with
from .search import CHANCE, K_SEEN, Model, Search, stripped

HOPELESS = 5.0  # held-out misfit after a few steps from which an effect in place of faults is given up
ONE_CAUSE = 0.25  # relative spread up to which several parameters are one cause


def instead_of_faults(search: Search, model: Model) -> list[Model]:
    """Models in which one effect stands for what several faults have in common, and as many of them vanish.

    A weaker magnet and three equal shorts are the same torque at the same current; the fewer causes, the likelier.
    """
    k = model.fit.point
    found = []
    for c in candidates(search.plant.plant, search.plant.data, []):
        common, gone = _common(model, c)
        if c.effect in model.names or not gone or len(gone) < len(c.linear):
            continue
        (c,) = probed(search, [c])
        while made := _in_place_of(search, model, c, gone, common):
            values = np.array([made.fit.point[f"{c.effect}.{name}"] for name in c.linear])
            if np.ptp(values) <= ONE_CAUSE * abs(values.mean()):
                found.append(made)
            gone.remove(max(gone, key=lambda name: k[name]))  # what is small may be there
            if made.heldout < model.heldout + CHANCE or len(gone) < len(c.linear):
                break
    return sorted(found, key=lambda m: m.heldout)


def without_common_faults(search: Search, model: Model, c: Candidate) -> Model | None:
    """`model` without what the faults that one of its effects can be mistaken for have in common, if they do."""
    common, gone = _common(model, c)
    if not gone:
        return None
    rest, frees = _without_common(model, c, common, gone)
    return search.model(model.effects, frees, {**model.fit.point, **rest}, model.fit.columns, 7)


def what_does_it_too(search: Search, model: Model, best: Model, known: set[str]) -> list[Model]:
    """What can do nearly all that the last effect of `best` does in place of faults of `model`, fitted like it."""
    effects, frees, rest = stripped(best, best.effects[-1])
    gone = {f.name: 0.0 for f in model.fit.free if f.name not in {g.name for g in frees}}
    return [
        search.model((*effects, s.candidate), (*frees, *s.candidate.frees), {**rest, **s.start, **gone}, None, 5)
        for s in looking_like(search, model, best, promising(search, model), known)
    ]


def _in_place_of(search: Search, model: Model, c: Candidate, gone: Sequence[str], common: float) -> Model | None:
    """`model` with an effect for what several faults have in common, and without those of them that are gone."""
    rest, frees = _without_common(model, c, common, gone)
    made = search.model((*model.effects, c), (*frees, *c.frees), start_with(search, model, c, rest), None, 3)
    if made.heldout > HOPELESS:
        return None
    return search.model(made.effects, made.fit.free, made.fit.point, made.fit.columns, 7)


def _common(model: Model, c: Candidate) -> tuple[float, list[str]]:
    """What the several faults that an effect can be mistaken for have in common, and which of them are no larger."""
    faults = {name: model.fit.point.get(name, 0.0) for name in c.faults}
    common = min(faults.values(), default=0.0)
    if len(faults) < 2 or common < K_SEEN:
        return 0.0, []
    return common, [name for name, x in faults.items() if x - common < K_SEEN]


def _without_common(model: Model, c: Candidate, common: float, gone: Sequence[str]) -> tuple[Point, tuple[Free, ...]]:
    """Faults of an effect less what they have in common, zero where they are gone, and what else stays free."""
    rest = {name: 0.0 if name in gone else model.fit.point[name] - common for name in c.faults}
    return rest, tuple(f for f in model.fit.free if f.name not in gone)
