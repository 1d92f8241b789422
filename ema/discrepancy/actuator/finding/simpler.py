"""Fewer causes that do as well: one effect for several faults, and faults without what effects are as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.actuator.fitting.candidates import ZERO_KNOWN, Candidate, Way, candidates, resolver_zero
from ema.discrepancy.actuator.fitting.free import Free
from ema.discrepancy.actuator.fitting.model import CHANCE, K_SEEN, NEAR, Model, strip
from ema.discrepancy.actuator.reading.zeros import SEEN
from ema.discrepancy.actuator.simulating.noise import Noise, Verdict
from ema.discrepancy.plant import Point
from ema.effects import registry

from .screening import find_look_alikes, find_one_for_several, probe, rank_to_first_order, start_with
from .verdicts import NEARLY
from .weighing import ALIKE, DOUBTFUL, SAME, is_alike, is_credible, is_enough, within_reach

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

HOPELESS = 5.0  # misfit promised, or held-out after a few steps, from which an effect in place of faults is given up
ONE_CAUSE = 0.25  # relative spread up to which several parameters are one cause


def _leaves_little(model: Model, v: Verdict, before: Model) -> bool:
    """Whether `model` may be right but for its noise or the form of its laws."""
    return v.is_noise or model.excess <= NEARLY or (bool(model.effects) and is_enough(model, before))


def drop_faults(
    search: Search, before: Model, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`model`, or where it leaves little, one without faults whose common part an effect of it can be just as well."""
    if not _leaves_little(model, v, before):
        return model, v
    for place, effect in enumerate(model.effects):
        m = drop_common_faults(search, model, effect)
        if m is None or search.left_more(m, model, (search.noise,)) > SAME:
            continue
        w = search.verdict(m)
        if w.is_noise or not v.is_noise:
            alike[place] = (*alike[place], _in_common(m, effect))
            model, v = m, w
            search.say(f"{effect.effect} without {alike[place][-1]}: p = {v.p_value:.2g}")
    return model, v


def _in_common(model: Model, effect: Candidate) -> str:
    """What an effect of `model` stands for: faults that the model does without, or what its faults have in common."""
    gone = [name for name in FAULTS if name not in {f.name for f in model.fit.free}]
    return f"{' and '.join(gone)} alike" if len(gone) > 1 else f"what {' and '.join(effect.faults)} have in common"


def _name_stand_ins(model: Model) -> str:
    """What the last effect of a model would stand for, told beside the faults."""
    effect = model.effects[-1]
    e = registry()[effect.effect]
    values = {p.name: model.fit.point.get(f"{e.name}.{p.name}", p.neutral) for p in e.parameters}
    common = _in_common(model, effect)
    return (
        f"instead of {common}, {e.said(values)} would explain the record as well; to tell them apart: {e.separated_by}"
    )


def simplify(
    search: Search, before: Model, model: Model, v: Verdict, alike: list[tuple[str, ...]], as_well: list[str]
) -> tuple[Model, Verdict]:
    """`model`, or where it leaves little, one with an effect for several faults that leaves no more.

    With no fewer parameters than `model` it must leave less; what leaves as much is told in `as_well`.
    What runs differ by depends on the model too, so either is weighed by the noise of both.
    """
    if not _leaves_little(model, v, before):
        return model, v
    as_good = []
    here = search.noise
    for m in replace_faults(search, model):
        if m.heldout > model.heldout + NEARLY:
            continue
        search.noise = Noise(search.plant, m.fit.point)
        m = search.model(m.effects, m.fit.free, m.fit.point, m.fit.columns, 1)
        more = search.left_more(m, model, (here, search.noise))
        w = search.verdict(m)
        fewer = len(m.fit.free) < len(model.fit.free)
        if more < (SAME if fewer else -CHANCE) and (w.is_noise or not v.is_noise):
            as_good.append((more, m, w, search.noise))
        elif more < CHANCE and w.is_noise:
            as_well.append(_name_stand_ins(m))
    search.noise = here
    if not as_good:
        return model, v
    least, m, w, search.noise = min(as_good, key=lambda found: found[0])
    near = [n for more, n, *_ in as_good if more - least < ALIKE * m.excess + CHANCE]
    rivals = dict.fromkeys(n.names[-1] for n in near)
    for n in fit_look_alikes(search, model, m, {n.effects[-1].way for n in near}):
        if search.left_more(n, m, (search.noise,)) < ALIKE * m.excess + CHANCE and is_credible(n):
            rivals[n.names[-1]] = None
    alike.append((_in_common(m, m.effects[-1]), *(name for name in rivals if name != m.names[-1])))
    search.say(f"{m.names[-1]} instead of {alike[-1][0]}: p = {w.p_value:.2g}")
    return m, w


def drop_constant_parts(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """`model` with effects that go with the temperature and no constant part, where that may be nothing."""
    for place, effect in enumerate(model.effects):
        constant = f"{effect.effect}.change"
        if effect.linear != ("change", "per_kelvin"):
            continue
        if abs(model.fit.point[constant]) > DOUBTFUL * model.fit.sd[constant]:
            continue
        frees = tuple(f for f in effect.frees if f.name != constant)
        only = replace(effect, frees=frees, linear=effect.linear[1:], steps=effect.steps[1:])
        effects = (*model.effects[:place], only, *model.effects[place + 1 :])
        free = [f for f in model.fit.free if f.name != constant]
        made = search.model(effects, free, {**model.fit.point, constant: 0.0}, model.fit.columns, 4)
        w = search.verdict(made)
        if made.heldout < model.heldout + SAME and (w.is_noise or not v.is_noise):
            model, v = made, w
    return model, v


def take_resolver_zero(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model` with a commutation that is off with the resolver's zero, if that does at least as well.

    What lies within a step of the user's sensor needs no cause.
    """
    zero = search.plant.data.zero or 0.0
    if not v.is_noise or "commutation_offset" in model.names or abs(zero) < search.plant.plant.sensors.lvdt_step:
        return model, v
    known = SEEN if search.plant.leaves_zero_open else ZERO_KNOWN  # a model tells it no finer
    c = resolver_zero(search.plant.plant, zero, known)
    made = search.model((*model.effects, c), (*model.fit.free, *c.frees), {**model.fit.point, **c.probes()[0]}, None, 2)
    w = search.verdict(made)
    more = search.left_more(made, model, (search.noise,))
    if not w.is_noise or more > SAME:
        return model, v
    alike.append(("a zero of theta_u",) if more > -SAME else ())
    return made, w


def fit_alike(search: Search, model: Model, place: int, rivals: tuple[str, ...]) -> dict[str, Model]:
    """The rivals of one effect fitted in its place, beside the effects that were found after it.

    None for the last effect, whose rivals were fitted so already, and none of what was never fitted as a last effect.
    Near noise a rival is at its minimum: what a fit has still to go counts there.
    """
    if place == len(model.effects) - 1:
        return {}
    found = {}
    for rival in (r for r in rivals if r not in model.names):
        beside = [m for m in search.tried if m.names and m.names[-1] == rival]
        if beside:
            made = search.instead(model, model.effects[place], beside[-1])
            found[rival] = search.at_minimum(made) if made.excess < NEAR else made
    return found


def keep_alike(search: Search, model: Model, place: int, rivals: tuple[str, ...]) -> tuple[str, ...]:
    """The rivals of one effect that do as well beside the effects that were found after it."""
    if place == len(model.effects) - 1:
        return rivals
    fitted = fit_alike(search, model, place, rivals)
    return tuple(r for r in rivals if r not in model.names and is_alike(fitted.get(r, model), model))


def fit_one_for_several(search: Search, model: Model) -> list[Model]:
    """Models with one effect in the place of several of `model`, where it does as well, at their minima.

    Effects are added one at a time. Where the first is not there, a second may mend what it leaves: a weaker magnet
    and a late controller did what a slow clock does.
    """
    found = []
    screened = rank_to_first_order(search, model) if len(model.effects) > 1 else []
    for n in range(2, len(model.effects) + 1):
        for several in combinations(model.effects, n):
            effects, frees, _ = strip(model, *several)
            for s in find_one_for_several(search, model, several, screened):
                free = (*frees, *s.candidate.frees)
                made = search.model((*effects, s.candidate), free, s.start, None, 5, within_reach(model))
                if is_alike(made, model):
                    found.append(search.settled(made))
    return found


def replace_faults(search: Search, model: Model) -> list[Model]:
    """Models in which one effect stands for what several faults have in common, and as many of them vanish.

    A weaker magnet and three equal shorts are the same torque at the same current; the fewer causes, the likelier.
    """
    k = model.fit.point
    found = []
    for c in candidates(search.plant.plant, search.plant.data, []):
        common, gone = _find_common(model, c)
        if c.effect in model.names or not gone or len(gone) < len(c.linear):
            continue
        (c,) = probe(search, [c])
        while made := _put_in_place_of_faults(search, model, c, gone, common):
            values = np.array([made.fit.point[f"{c.effect}.{name}"] for name in c.linear])
            if np.ptp(values) <= ONE_CAUSE * abs(values.mean()):
                found.append(made)
            gone.remove(max(gone, key=lambda name: k[name]))  # what is small may be there
            if made.heldout < model.heldout + CHANCE or len(gone) < len(c.linear):
                break
    return sorted(found, key=lambda m: m.heldout)


def drop_common_faults(search: Search, model: Model, c: Candidate) -> Model | None:
    """`model` without what the faults that one of its effects can be mistaken for have in common, if they do."""
    common, gone = _find_common(model, c)
    if not gone:
        return None
    rest, frees = _drop_common(model, c, common, gone)
    return search.model(model.effects, frees, {**model.fit.point, **rest}, model.fit.columns, 7)


def fit_look_alikes(search: Search, model: Model, best: Model, known: set[Way]) -> list[Model]:
    """What can do nearly all that the last effect of `best` does in place of faults of `model`, fitted like it."""
    effects, frees, rest = strip(best, best.effects[-1])
    gone = {f.name: 0.0 for f in model.fit.free if f.name not in {g.name for g in frees}}
    return [
        search.model((*effects, s.candidate), (*frees, *s.candidate.frees), {**rest, **s.start, **gone}, None, 5)
        for s in find_look_alikes(search, model, best, rank_to_first_order(search, model), known)
    ]


def _put_in_place_of_faults(
    search: Search, model: Model, c: Candidate, gone: Sequence[str], common: float
) -> Model | None:
    """`model` with an effect for what several faults have in common, and without those of them that are gone."""
    rest, frees = _drop_common(model, c, common, gone)
    start = start_with(search, model, c, rest)
    made = search.model((*model.effects, c), (*frees, *c.frees), start, None, 3, HOPELESS)
    if made.heldout > HOPELESS:
        return None
    return search.model(made.effects, made.fit.free, made.fit.point, made.fit.columns, 7)


def _find_common(model: Model, c: Candidate) -> tuple[float, list[str]]:
    """What the several faults that an effect can be mistaken for have in common, and which of them are no larger."""
    faults = {name: model.fit.point.get(name, 0.0) for name in c.faults}
    common = min(faults.values(), default=0.0)
    if len(faults) < 2 or common < K_SEEN:
        return 0.0, []
    return common, [name for name, x in faults.items() if x - common < K_SEEN]


def _drop_common(model: Model, c: Candidate, common: float, gone: Sequence[str]) -> tuple[Point, tuple[Free, ...]]:
    """Faults of an effect less what they have in common, zero where they are gone, and what else stays free."""
    rest = {name: 0.0 if name in gone else model.fit.point[name] - common for name in c.faults}
    return rest, tuple(f for f in model.fit.free if f.name not in gone)
