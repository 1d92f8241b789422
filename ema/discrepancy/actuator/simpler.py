"""Fewer causes that do as well: one effect for several faults, and faults without what effects are as well."""

from __future__ import annotations

from dataclasses import replace

from ema.core.names import FAULTS
from ema.effects import registry

from .candidates import Candidate, resolver_zero
from .forward import SAME
from .in_place import instead_of_faults, what_does_it_too, without_common_faults
from .noise import Noise, Verdict
from .search import CHANCE, Model, Search
from .verdicts import NEARLY
from .weighing import ALIKE, DOUBTFUL, is_alike, is_credible, is_enough


def _leaves_little(model: Model, v: Verdict, before: Model) -> bool:
    """Whether `model` may be right but for its noise or the form of its laws."""
    return v.is_noise or model.excess <= NEARLY or (bool(model.effects) and is_enough(model, before))


def with_fewer_faults(
    search: Search, before: Model, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`model`, or where it leaves little, one without faults whose common part an effect of it can be just as well."""
    if not _leaves_little(model, v, before):
        return model, v
    for place, effect in enumerate(model.effects):
        m = without_common_faults(search, model, effect)
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


def _instead(model: Model) -> str:
    """What the last effect of a model would stand for, told beside the faults."""
    effect = model.effects[-1]
    e = registry()[effect.effect]
    values = {p.name: model.fit.point.get(f"{e.name}.{p.name}", p.neutral) for p in e.parameters}
    common = _in_common(model, effect)
    return (
        f"instead of {common}, {e.said(values)} would explain the record as well; to tell them apart: {e.separated_by}"
    )


def simpler(
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
    for m in instead_of_faults(search, model):
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
            as_well.append(_instead(m))
    search.noise = here
    if not as_good:
        return model, v
    least, m, w, search.noise = min(as_good, key=lambda found: found[0])
    rivals = dict.fromkeys(n.names[-1] for more, n, *_ in as_good if more - least < ALIKE * m.excess + CHANCE)
    for n in what_does_it_too(search, model, m, set(rivals)):
        if search.left_more(n, m, (search.noise,)) < ALIKE * m.excess + CHANCE and is_credible(n):
            rivals[n.names[-1]] = None
    alike.append((_in_common(m, m.effects[-1]), *(name for name in rivals if name != m.names[-1])))
    search.say(f"{m.names[-1]} instead of {alike[-1][0]}: p = {w.p_value:.2g}")
    return m, w


def with_temperature_only(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
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


def with_zero(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model` with a commutation that is off with the resolver's zero, if that does at least as well.

    What lies within a step of the user's sensor needs no cause.
    """
    zero = search.plant.data.zero
    if not v.is_noise or "commutation_offset" in model.names or abs(zero) < search.plant.plant.sensors.lvdt_step:
        return model, v
    c = resolver_zero(search.plant.plant, zero)
    made = search.model((*model.effects, c), (*model.fit.free, *c.frees), {**model.fit.point, **c.probes()[0]}, None, 2)
    w = search.verdict(made)
    more = search.left_more(made, model, (search.noise,))
    if not w.is_noise or more > SAME:
        return model, v
    alike.append(("a zero of theta_u",) if more > -SAME else ())
    return made, w


def still_alike(search: Search, model: Model, place: int, rivals: tuple[str, ...]) -> tuple[str, ...]:
    """The rivals of one effect that do as well beside the effects that were found after it."""
    if place == len(model.effects) - 1:
        return rivals
    kept = []
    for rival in (r for r in rivals if r not in model.names):
        beside = [m for m in search.tried if m.names and m.names[-1] == rival]
        m = search.instead(model, model.effects[place], beside[-1]) if beside else model
        if is_alike(m, model):
            kept.append(rival)
    return tuple(kept)
