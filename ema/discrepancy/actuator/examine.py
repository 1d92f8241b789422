"""The whole examination of an actuator's cycles: verdict, effects, structure, gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import FAULTS
from ema.discrepancy.findings import Findings, FoundEffect, Gain, Quantity
from ema.effects import registry
from ema.effects.base import ABSENT
from ema.models.actuator import Actuator

from .candidates import Candidate, resolver_zero
from .comparators import CLEAR, PLAIN, find_step, take_step
from .conditions import as_recorded
from .cycles import Measured
from .extension import as_extension
from .features import Array
from .fit import Fit
from .gear import swinging
from .growing import beside, growing, said
from .noise import N_RUNS_SURE, Noise, Verdict
from .plant import ENVELOPE_STEP, EmaPlant, Point
from .select import CHANCE, FAR, FINAL_SEED, K_SEEN, MAX_EFFECTS, N_FINAL, NEARLY_ALL, Model, Search, start_model
from .structure import structure
from .thinning import thinned
from .timing import samples_late

MIN_CYCLES = 2
IMPLEMENTATION = 2e-3  # of a value: what honest simulations of the same laws make of it (steps, starts, sampling)
FORM = 0.5  # of a value, for a rest as large as the whole effect: the interval holds what would take all of the rest
WORTH_IT = 0.25  # share of what is left that a further effect must take on held-out cycles
ENOUGH = 0.05  # share of what faults alone leave, from which effects explain it but for the form of their laws
STRONG = 0.6  # share of what is left that a further effect must take when there is enough already
NAMED = 0.95  # share of what faults alone leave that effects must explain to be named when a rest stays unexplained
OWN_SHARE = 0.5  # of a gain that must go when the effect alone is switched off
DISTANT = 10.0  # excess of a model that is far from the data
ALIKE = 0.6  # share by which two models may leave more or less and be alike: laws are approximations
NEW_NOISE = 0.5  # share of what was left when the noise was estimated, from which it is estimated anew
CLOSE = 0.5  # share of what was left, from which another turn is not worth it
SAME = 0.05  # difference in held-out misfit up to which fewer causes are preferred
UNLIKELY = 0.1  # odds of an effect, against what is no credible cause too, below which it is not named
NEARLY = 0.5  # excess of a model that may be the right one but for switching
NEAR, N_OWN = 1.0, 3  # excess up to which so many models are weighed by noise of their own
UNCERTAIN_LAW = 0.85  # of a confidence where a rest is left that nothing explains: it may be another law altogether
DOUBTFUL = 2.0  # deviations from nothing, below which an effect is not named
SLACK = 0.1  # misfit that switching noise may make
ENVELOPE_SETTLING = 15e-3  # [s]
FAULT_ALARM = 0.02  # a fault that an operator would be told of
N_EXCHANGED = 2  # likeliest others that are tried in place of an earlier effect where a rest is left
N_BESIDE = 2  # turns in which faults of each cycle are found anew beside the effects
NON_INTEGER = 0.06  # distance of an order from the next integer from which it is none


@dataclass(frozen=True)
class Examination:
    """The answer with what the report draws."""

    findings: Findings
    search: Search
    before: Model
    after: Model
    verdict_before: Verdict
    verdict_after: Verdict


@dataclass(frozen=True)
class Path:
    """One way through the search: with what noise, step of the comparators and command, from where to where.

    `alike` holds, for each effect of `after`, what does as well in its place, `as_well` the effects that would explain
    as well what several of its faults have in common.
    """

    noise: Noise
    step: float | None
    late: int
    tried: list[Model]
    before: Model
    verdict_before: Verdict
    after: Model
    verdict: Verdict
    alike: list[tuple[str, ...]]
    as_well: list[str]

    @classmethod
    def of(cls, search: Search, model: Model) -> Path:
        """The beginning, where nothing is explained yet."""
        v = search.verdict(model)
        plant = search.plant
        return cls(search.noise, plant.step, plant.late, list(search.tried), model, v, model, v, [], [])


def split(data: Measured) -> tuple[list[int], list[int]]:
    """Training and held-out cycles: of every motion the last third, at least one where there are two."""
    train, heldout = [], []
    for motion in range(len(data.commands)):
        cycles = np.flatnonzero(data.motion == motion).tolist()
        n = len(cycles) // 3 or len(cycles) // 2
        train += cycles[: len(cycles) - n]
        heldout += cycles[len(cycles) - n :]
    if not heldout:  # every motion once: every second motion is held out
        train, heldout = sorted(train)[::2], sorted(train)[1::2]
    return sorted(train), sorted(heldout)


def examine(
    plant: Actuator, data: Measured, *, n_threads: int = 2, say: Callable[[str], None] = lambda t: None
) -> Examination:
    """What the simulation of `plant` gets wrong about `data`."""
    if data.n_cycles < MIN_CYCLES:
        raise RecordError(
            f"{data.labels[0]}: is the only cycle; at least {MIN_CYCLES} are needed, to test on one what another says"
        )
    data, left_out = thinned(data)
    train, heldout = split(data)
    plant, conditions = as_recorded(plant, data.signals)
    if left_out:
        conditions.append(left_out)
    data = swinging(plant, data)
    ema = EmaPlant(plant, data, n_threads)
    say("switching noise")
    search = Search(ema, Noise(ema, {}), train, heldout, say)
    paths = _faults_only(search, {})
    of_each = None if paths[0].verdict.is_noise else growing(search, paths[0].before)
    if of_each is not None:
        search = _with_faults(search, of_each, {})
        paths = _faults_only(search, search.noise.point)
    path = _shortest(search, paths)
    for turn in range(N_BESIDE):
        if of_each is None or not path.after.effects or (turn and path.verdict.is_noise):
            break
        _resume(search, path)
        of_each = beside(search, path.after)
        search = _with_faults(search, of_each, path.after.fit.point)
        path = _gone_on(search, path)
    _resume(search, path)
    if of_each is not None:
        conditions.append(said(of_each))
    ema = search.plant
    before, alike = path.before, path.alike
    after, v = settled, _ = _settled(search, path.after, path.verdict)
    if not path.verdict_before.is_noise:
        after, v = _with_fewer_faults(search, after, v, alike)
        after, v = _simpler(search, after, v, alike, path.as_well)
    after, v = _without_superfluous(search, after, v, alike)
    if after is not settled:
        after, v = _settled(search, after, v)
    after, v = _without_doubtful(search, after, v, alike)
    after, v = _with_zero(search, after, v, alike)
    sets = [(name, *rivals) for name, rivals in zip(after.names, alike, strict=True)]
    unlikely = [names[0] for names in sets if sum(_confidence(search, after, *names)) < UNLIKELY]
    if unlikely:
        after, v, alike = before, path.verdict_before, []
        conditions.append(f"{', '.join(unlikely)} would do, but what can be no cause would do much better: not named")
    alike = [_still_alike(search, after, j, rivals) for j, rivals in enumerate(alike)]
    findings = _findings(search, before, after, v, alike)
    if findings.verdict == "adequate":
        conditions.extend(path.as_well)
    if findings.verdict == "unexplained" and not findings.effects and not findings.unnamed:
        findings, after = _with_function(search, findings, before, after)
    if ema.late:
        side, samples = "late" if ema.late > 0 else "early", "sample" if abs(ema.late) == 1 else "samples"
        conditions.append(f"the recorded command is {abs(ema.late)} {samples} {side} against the other channels")
    if data.zero:
        conditions.append(f"θ_m/GR and θ_u are {data.zero:.2g} rad apart in the middle of the play")
    if path.step:
        conditions.append(f"the comparators of the record switch as if evaluated every {1e6 * path.step:g} µs")
    findings.notes.extend(conditions)
    return Examination(findings, search, before, after, path.verdict_before, v)


def _with_faults(search: Search, of_each: Array, point: Point) -> Search:
    """A search from the beginning with faults of each cycle, shape (n_cycles, 6), and noise as at their mean."""
    mean = of_each.mean(axis=0)
    old = search.plant
    plant = EmaPlant(old.plant, replace(old.data, faults=of_each - mean), old.n_threads)
    plant.late = old.late
    take_step(plant, old.step)
    noise = Noise(plant, {**point, **dict(zip(FAULTS, mean.tolist(), strict=True))})
    return Search(plant, noise, search.train, search.heldout, search.say)


def _gone_on(search: Search, path: Path) -> Path:
    """A path to its end from the effects that were found, after the cycles' faults were found anew beside them.

    Odds stay those of what was tried beside the same faults.
    """
    before = start_model(search, {name: search.noise.point[name] for name in FAULTS})
    after = search.model(path.after.effects, path.after.fit.free, search.noise.point, None, 4)
    v, known = search.verdict(after), Path.of(search, before)
    begun = replace(known, tried=path.tried, after=after, verdict=v, alike=path.alike, as_well=path.as_well)
    return _gone(search, begun)


def _faults_only(search: Search, faults: Point) -> list[Path]:
    """Paths that begin with faults alone, from where these are expected.

    What faults make of the noise weighs what tells them; both are found in turn.

    Where that leads nowhere near the data, the faults found stand for something else. Then the noise may be what it is
    without faults, or what they make of it: friction or drag, whatever their cause, change it hundredfold.
    """
    model = start_model(search, faults)
    late = samples_late(search.plant, search.noise, model.fit.point, search.train) if model.excess > NEARLY else 0
    if late:
        search.plant.late = late
        model = start_model(search, faults)
    nominal = Path.of(search, model)
    if nominal.verdict.is_noise and max(model.fit.point.get(name, 0.0) for name in FAULTS) < FAULT_ALARM:
        return [nominal]
    while True:
        left = model.excess
        search.noise = Noise(search.plant, model.fit.point)
        model = search.model((), model.fit.free, model.fit.point, model.fit.columns, 1)
        own = Path.of(search, model)
        if own.verdict.is_noise or model.excess < NEARLY:
            return [own]
        if model.excess > CLOSE * left:
            return [own] if model.excess < DISTANT else [nominal, own]
        model = search.model((), model.fit.free, model.fit.point, None, 6)


def _shortest(search: Search, paths: list[Path]) -> Path:
    """The first path that leaves next to nothing, or else the one that leaves least by the noise of both."""
    best = _gone(search, paths[0])
    for path in paths[1:]:
        if best.verdict.is_noise or best.after.excess < CHANCE:
            break
        search.say("again, with the noise that faults alone make")
        other = _gone(search, path)
        if search.left_more(other.after, best.after, (other.noise, best.noise)) < 0.0:
            best = other
    return best


def _resume(search: Search, path: Path) -> None:
    """Noise, tried models and conditions of the bench as they are on a path."""
    search.noise, search.tried = path.noise, list(path.tried)
    take_step(search.plant, path.step)
    search.plant.late = path.late


def _gone(search: Search, begun: Path) -> Path:
    """A path to its end: what explains the cycles."""
    _resume(search, begun)
    before, verdict_before = _surely(search, begun.before, begun.verdict_before)
    if not verdict_before.is_noise and not begun.after.effects:
        before, verdict_before = _as_on_the_bench(search, before, verdict_before, PLAIN)
    search.say(f"faults only: p = {verdict_before.p_value:.2g}, most visible: {verdict_before.loudest}")
    alike, as_well = list(begun.alike), list(begun.as_well)
    after, v = (begun.after, begun.verdict) if begun.after.effects else (before, verdict_before)
    after, v = _grown(search, before, after, v, alike)
    if not v.is_noise:
        after, v = _exchanged(search, after, v, alike)
    if not v.is_noise:  # the library had its chance
        other, w = _as_on_the_bench(search, after, v)
        if other is not after:
            if after is before:
                before, verdict_before = other, w
            after, v = _grown(search, before, other, w, alike)
    if verdict_before.is_noise:
        after, v = _simpler(search, after, v, alike, as_well)
    plant = search.plant
    return Path(search.noise, plant.step, plant.late, search.tried, before, verdict_before, after, v, alike, as_well)


def _grown(
    search: Search, before: Model, after: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`after` with as many further effects as are real."""
    left = after.excess
    while not v.is_noise and len(set(after.names) - {"torque_line"}) < MAX_EFFECTS:  # a second line is no further cause
        enough = _is_enough(after, before)
        screened = search.promising(after)
        models = search.extend(after, screened)
        needed = max(STRONG * after.excess, CHANCE) if enough else WORTH_IT * after.excess
        real = _real(search, models, after, needed)
        if not real and needed <= after.excess < FAR:
            real = _real(search, search.extend(after, screened, models), after, needed)
        if not real and enough:
            real = _leaving_noise(search, models, after)
        if not real:
            break
        after, *rivals = [m for m in real if _is_alike(m, real[0])]
        # What runs differ by depends on the point, and so does every weight.
        noise = Noise(search.plant, after.fit.point)
        while after.excess < NEW_NOISE * left or search.excess_by(noise, after) < NEW_NOISE * left:
            near = [m for m in real if m in (after, *rivals) or m.excess < max(NEARLY, NEARLY_ALL * left)]
            search.noise = noise
            near = [search.model(m.effects, m.fit.free, m.fit.point, m.fit.columns, 2) for m in near]
            after, *rivals = sorted(near, key=lambda m: m.heldout)
            left = max(after.excess, CHANCE)
            if left < SLACK:
                break
            real, noise = near, Noise(search.plant, after.fit.point)
        rivals = [m for m in rivals if _is_alike(m, after) and not _may_be_nothing(search, m, m.effects[-1])]
        alike.append(tuple(m.names[-1] for m in rivals))
        after, v = _surely(search, after, search.verdict(after))
        if not v.is_noise:
            after, v = _as_on_the_bench(search, after, v, PLAIN)
        if not v.is_noise:
            after, v = _settled(search, after, v)
        search.say(f"{' + '.join(after.names)}: p = {v.p_value:.2g}")
    return after, v


def _exchanged(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model`, or one with another effect in place of an earlier one, which was chosen before the others were there."""
    for effect in model.effects[:-1]:
        place = model.effects.index(effect)
        there = [m for m in search.tried if m.effects and m.names[:-1] == model.names[:place]]
        beside = [m for m in there if m.names[-1] not in model.names]
        best = {m.names[-1]: m for m in sorted(beside, key=lambda m: -m.heldout)}
        for rival in sorted(best.values(), key=lambda m: m.heldout)[:N_EXCHANGED]:
            made = search.instead(model, effect, rival)
            if made.excess < CLOSE * model.excess and _is_credible(made):
                search.say(f"{rival.names[-1]} instead of {effect.effect}")
                del alike[place]
                alike.append(())
                model, v = made, search.verdict(made)
                break
    return model, v


def _is_enough(model: Model, before: Model) -> bool:
    """Whether effects explain all but what the form of their laws may leave, which is never far from the data."""
    return bool(model.effects) and model.excess < min(ENOUGH * before.excess + SLACK, DISTANT)


def _real(search: Search, models: Sequence[Model], after: Model, needed: float) -> list[Model]:
    """Of models with one more effect than `after`, those in which it is real: credible, and the gain is its own."""
    gaining = [m for m in models if after.excess - m.excess >= needed]
    return _by_themselves(search, gaining, after) or _with_own_noise(
        search, [m for m in models if m.heldout < after.heldout + SAME], after
    )


def _by_themselves(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models with a credible last effect to which they owe what they gain over `after`."""
    return [m for m in models if _is_credible(m) and _does_it(search, m, after)]


def _leaving_noise(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models that leave noise where `after` leaves hardly more, as no law of another form makes it.

    The misfit of noise itself is not one but for the noise that it was estimated from.
    """
    gaining = [m for m in models if after.heldout - m.heldout > 2.0 * CHANCE]
    return [m for m in _by_themselves(search, gaining, after) if search.verdict(m).is_noise]


def _is_alike(model: Model, best: Model) -> bool:
    """Whether a model leaves little more than the best, or nothing as well."""
    more = SLACK if model.excess < CHANCE else CHANCE
    return model.heldout - best.heldout < ALIKE * best.excess + more


def _with_own_noise(search: Search, models: list[Model], after: Model) -> list[Model]:
    """Of the likeliest models those that do better, when noise is estimated where they are, best first.

    What runs differ by depends on the point. Where faults stand for an effect, the noise there hides what the true
    model gains; so either is weighed by its own, and must do better by that of both.
    """
    if not 0.0 < after.excess <= NEAR:
        return []
    here, found = search.noise, []
    for m in models[:N_OWN]:
        search.noise = Noise(search.plant, m.fit.point)
        m = search.model(m.effects, m.fit.free, m.fit.point, m.fit.columns, 2)
        less = -search.left_more(m, after, (here, search.noise))
        if m.excess < CLOSE * after.excess and less > CHANCE and _is_credible(m):
            found.append((m, search.noise))
    found.sort(key=lambda entry: entry[0].heldout)
    search.noise = found[0][1] if found else here
    return [m for m, _ in found]


def _surely(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """The verdict, in a close case by a null distribution from more runs and by another step of the comparators."""
    if v.is_noise or model.excess > NEARLY:
        return model, v
    search.noise = Noise(search.plant, model.fit.point, N_RUNS_SURE)
    v = search.verdict(model)
    return (model, v) if v.is_noise else _as_on_the_bench(search, model, v, PLAIN)


def _as_on_the_bench(search: Search, model: Model, v: Verdict, share: float = CLEAR) -> tuple[Model, Verdict]:
    """`model` with the command and the grid of the comparators that the record seems to have, if others than ours."""
    late = samples_late(search.plant, search.noise, model.fit.point, search.train)
    if late:
        search.plant.late = late
        model = search.model(model.effects, model.fit.free, model.fit.point, None, 3)
        v = search.verdict(model)
        search.say(f"command {late:+d} samples late: p = {v.p_value:.2g}")
        if v.is_noise:
            return model, v
    step = find_step(search.plant, search.noise, model.fit.point, search.train, share)
    if step is None:
        return model, v
    take_step(search.plant, step)
    search.noise = Noise(search.plant, model.fit.point, N_RUNS_SURE)
    model = search.model(model.effects, model.fit.free, model.fit.point, None, 2)
    v = search.verdict(model)
    search.say(f"comparators every {1e6 * step:g} µs: p = {v.p_value:.2g}")
    return model, v


def _with_fewer_faults(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model`, or where it leaves little, one without faults whose common part an effect of it can be just as well."""
    if not v.is_noise and model.excess > NEARLY:
        return model, v
    for place, effect in enumerate(model.effects):
        m = search.without_common_faults(model, effect)
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


def _simpler(
    search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]], as_well: list[str]
) -> tuple[Model, Verdict]:
    """`model`, or where it leaves little, one with an effect for several faults that leaves no more.

    With no fewer parameters than `model` it must leave less; what leaves as much is told in `as_well`.
    What runs differ by depends on the model too, so either is weighed by the noise of both.
    """
    if not v.is_noise and model.excess > NEARLY:
        return model, v
    as_good = []
    here = search.noise
    for m in search.instead_of_faults(model):
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
    for n in search.alike(model, m, set(rivals)):
        if search.left_more(n, m, (search.noise,)) < ALIKE * m.excess + CHANCE and _is_credible(n):
            rivals[n.names[-1]] = None
    alike.append((_in_common(m, m.effects[-1]), *(name for name in rivals if name != m.names[-1])))
    search.say(f"{m.names[-1]} instead of {alike[-1][0]}: p = {w.p_value:.2g}")
    return m, w


def _without_superfluous(
    search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`model` without the effects that others have made superfluous, or that have only led the fit there."""
    for effect in model.effects:
        if len(model.effects) > 1 and search.owed_to(model, effect) < CHANCE:
            model, v = _dropped(search, model, v, alike, effect, "is superfluous")
    return model, v


def _without_doubtful(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model` without the effects whose intervals hold nothing at all: they have only led the fit there."""
    for effect in model.effects:
        if _may_be_nothing(search, model, effect):
            model, v = _dropped(search, model, v, alike, effect, "may be nothing")
    return model, v


def _may_be_nothing(search: Search, model: Model, effect: Candidate) -> bool:
    """Whether the intervals of an effect hold nothing at all. Parameters each in doubt may be sure together."""
    names = [f"{effect.effect}.{name}" for name in effect.linear]
    away = (abs(model.fit.point[name] - search.plant.neutral(name)) / max(model.fit.sd[name], 1e-300) for name in names)
    return max(away) <= DOUBTFUL


def _dropped(
    search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]], effect: Candidate, why: str
) -> tuple[Model, Verdict]:
    """`model` without one of its effects, unless more is left without it."""
    reduced = search.without(model, effect)
    if reduced.heldout >= model.heldout + SAME:
        return model, v
    del alike[model.effects.index(effect)]
    v = search.verdict(reduced)
    search.say(f"{effect.effect} {why}: p = {v.p_value:.2g}")
    return reduced, v


def _with_zero(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
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


def _settled(search: Search, model: Model, v: Verdict) -> tuple[Model, Verdict]:
    """`model` with faults and effects told apart that look nearly the same, as far as the record allows."""
    if not model.effects or model.excess > DISTANT:
        return model, v
    found = search.settled(model)
    if found.heldout <= model.heldout + CHANCE:
        return found, search.verdict(found)
    sd = {name: max(x, found.fit.sd[name]) for name, x in model.fit.sd.items()}  # the record tells no better
    return replace(model, fit=replace(model.fit, sd=sd)), v


def _still_alike(search: Search, model: Model, place: int, rivals: tuple[str, ...]) -> tuple[str, ...]:
    """The rivals of one effect that do as well beside the effects that were found after it."""
    if place == len(model.effects) - 1:
        return rivals
    kept = []
    for rival in (r for r in rivals if r not in model.names):
        beside = [m for m in search.tried if m.names and m.names[-1] == rival]
        m = search.instead(model, model.effects[place], beside[-1]) if beside else model
        if _is_alike(m, model):
            kept.append(rival)
    return tuple(kept)


def _is_credible(model: Model) -> bool:
    """Whether no parameter of the last effect is driven to what is physically credible at most."""
    effect = model.names[-1]
    for p in registry()[effect].parameters:
        x = model.fit.point.get(f"{effect}.{p.name}")
        margin = 1e-3 * (p.high - p.low)
        if x is not None and any(abs(x - end) < margin and end not in (p.neutral, ABSENT) for end in (p.low, p.high)):
            return False
    return True


def _does_it(search: Search, model: Model, previous: Model) -> bool:
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


def _findings(search: Search, before: Model, after: Model, v: Verdict, alike: list[tuple[str, ...]]) -> Findings:
    torque_lines = [c for c in after.effects if c.effect in ("cogging", "torque_line")]
    odd = [c for c in torque_lines if not _integer(after.fit, c.effect)]
    further = [c for c in torque_lines if c.effect == "torque_line" and not odd]
    explained = v.is_noise or _is_enough(after, before)
    verdict: Literal["adequate", "explained", "unexplained"] = (
        "adequate" if not after.effects and v.is_noise else "explained" if explained and not odd else "unexplained"
    )
    notes: list[str] = []
    shape: dict[str, Any] = {}
    left = after.excess / max(before.excess, 1e-9)
    share = 1.0 - left
    too_little = verdict == "unexplained" and share < NAMED
    if verdict == "unexplained" or (after.effects and not v.is_noise):
        base = Model((), before.fit, before.heldout) if odd or too_little else after  # beside what is named
        shape = structure(search.torques(base), search.plant.plant.control.rate, v.scores)
    if verdict == "explained" and not v.is_noise:
        notes.append("a small rest above noise is left: the true law has another form than the library's")
    if not search.plant.data.has_temperature:
        notes.append("no winding temperature (temp_w) was recorded: effects of temperature are seen as constant")
    kept = [(c, a) for c, a in zip(after.effects, alike, strict=False) if c.effect != "torque_line" and c not in odd]
    rest = 0.0 if v.is_noise else float(np.sqrt(max(left, _left_in_training(before, after))))
    found = [_found(search, after, c.effect, a, rest) for c, a in kept]
    found = [_whatever_the_cause(search, after, e, kept) for e in found]
    if verdict == "unexplained":
        found = [replace(e, confidence=UNCERTAIN_LAW * e.confidence) for e in found]
    if too_little and found:
        notes.append(
            f"{', '.join(e.name for e in found)} would explain {share:.0%} of the rest: too little to be named"
        )
        found = []
    for c in odd:
        at, amplitude = (after.fit.point[f"{c.effect}.{name}"] for name in ("order", "amplitude"))
        notes.append(f"a torque line at the non-integer order {at:.4g} is no cogging of this motor")
        shape["orders"] = [{"order": at, "amplitude": amplitude, "share": 1.0 - after.excess / before.excess}]
        shape["sentences"] = [f"a torque line of {amplitude:.2g} N m at {at:.4g} periods per rotor turn"]
    tried = [
        {"name": " + ".join(m.names) or "faults only", "score": -m.heldout}
        for m in sorted(search.tried, key=lambda m: m.heldout)
    ]
    unnamed = [_found(search, after, c.effect, (), rest, "torque_line") for c in (*odd, *further)][:1]
    if further:
        values = {name: q.value for name, q in unnamed[0].parameters.items()}
        unnamed = [replace(unnamed[0], sentence=f"a further {registry()['cogging'].said(values)}")]
        notes.append(f"beside it stands {unnamed[0].sentence}")
    return Findings(verdict, found, _gain(search, before, after), shape, tried, notes, unnamed=unnamed)


def _left_in_training(before: Model, after: Model) -> float:
    """Share of what there was beyond noise in training cycles that is left."""
    return max(after.fit.misfit - 1.0, 0.0) / max(before.fit.misfit - 1.0, 1e-9)


def _with_function(search: Search, findings: Findings, before: Model, after: Model) -> tuple[Findings, Model]:
    """What the structure says as a function, simulated: part of the extended plant if held-out cycles gain by it."""
    base = Model((), before.fit, before.heldout)
    for effect, values in as_extension(findings.structure).items():
        table = {f"{effect}.{name}": value for name, value in values.items()}
        m = search.model((), base.fit.free, {**base.fit.point, **table}, None, 4)
        if base.excess - m.excess < WORTH_IT * base.excess:
            continue
        e = registry()[effect]
        quantities = {p.name: Quantity(values[p.name], values[p.name], values[p.name], p.unit) for p in e.parameters}
        unnamed = [FoundEffect(effect, 0.0, (), quantities, e.said(values), e.separated_by)]
        share = 1.0 - m.excess / base.excess
        findings.structure["sentences"].append(f"{e.said(values)}, takes {share:.0%} of the rest")
        return replace(findings, unnamed=unnamed, gain=_gain(search, before, m)), m
    return findings, after


def _integer(fit: Fit, line: str) -> bool:
    order = fit.point[f"{line}.order"]
    sd = fit.sd[f"{line}.order"]
    return abs(order - round(order)) < max(NON_INTEGER, 3.0 * sd)


def _found(
    search: Search, model: Model, effect: str, alike: tuple[str, ...], rest: float, told_as: str = ""
) -> FoundEffect:
    """What was fitted as `effect`, told as that or as another effect with the same parameters.

    `rest` is the amplitude of what is left above noise over that of what there was to explain. A fault that the effect
    took the place of was taken for none; it may be as large as what is not seen.
    """
    e = registry()[told_as or effect]
    fit = model.fit
    bounds = {f.name: f for f in fit.free}
    c = next(c for c in model.effects if c.effect == effect)
    gone = [name for name in c.faults if name not in bounds]
    small = K_SEEN / np.sqrt(12.0) * np.sqrt(len(gone) * len(c.linear)) / max(len(c.faults), 1)
    values = {p.name: fit.point.get(f"{effect}.{p.name}", p.neutral) for p in e.parameters}
    parameters = {}
    for p in e.parameters:
        name = f"{effect}.{p.name}"
        if name in bounds:
            parts = [fit.sd[name], IMPLEMENTATION * values[p.name], FORM * rest * values[p.name]]
            sd = float(np.linalg.norm([*parts, small if p.unit == "1" and p.name in c.linear else 0.0]))
            f = bounds[name]
            parameters[p.name] = Quantity(
                values[p.name], max(values[p.name] - 1.96 * sd, f.low), min(values[p.name] + 1.96 * sd, f.high), p.unit
            )
    confidence, *_ = _confidence(search, model, effect)
    return FoundEffect(e.name, confidence, alike, parameters, e.said(values), e.separated_by)


def _whatever_the_cause(
    search: Search, model: Model, found: FoundEffect, kept: Sequence[tuple[Candidate, tuple[str, ...]]]
) -> FoundEffect:
    """`found` with intervals that hold its parameters beside the rivals of the other effects too."""
    parameters = dict(found.parameters)
    for other, rivals in kept:
        for rival in rivals if other.effect != found.name else ():
            names = {rival if name == other.effect else name for name in model.names}
            beside = [m for m in search.tried if len(m.names) == len(model.names) and set(m.names) == names]
            if not beside:  # faults, or the zero of a sensor
                continue
            fit = min(beside, key=lambda m: m.heldout).fit
            for name, q in parameters.items():
                p = f"{found.name}.{name}"
                x, reach = fit.point.get(p, q.value), 1.96 * fit.sd.get(p, 0.0)
                parameters[name] = replace(q, low=min(q.low, x - reach), high=max(q.high, x + reach))
    return replace(found, parameters=parameters)


def _confidence(search: Search, model: Model, effect: str, *rivals: str) -> list[float]:
    """Odds of an effect of `model`, and of its rivals, against all that was tried in its place, by held-out misfit.

    Differences that seeds make do not count; a library is never complete.
    """
    place = model.names.index(effect)
    n = sum(len(search.plant.data.y[c]) for c in search.heldout)
    best: dict[str, float] = {}
    for m in search.tried:
        if len(m.names) > place and m.names[:place] == model.names[:place] and len(m.names) == place + 1:
            best[m.names[place]] = min(m.heldout, best.get(m.names[place], np.inf))
    own = best.get(effect, model.heldout)
    least = min([own, *best.values()])
    more = {name: max(x - least - CHANCE, 0.0) for name, x in {**best, effect: own}.items()}
    odds = {name: np.exp(-0.5 * n * x / max(least, 1.0)) for name, x in more.items()}
    return [float(0.99 * odds.get(name, 0.0) / sum(odds.values())) for name in (effect, *rivals)]


def settled(plant: EmaPlant) -> int:
    """First sample of the envelope that the low-pass no longer ties to the unknown current at the start."""
    return round(ENVELOPE_SETTLING * plant.plant.control.rate) // ENVELOPE_STEP


def envelope_error(search: Search, point: Point, cycles: list[int]) -> float:
    """Rms of measured less mean simulated envelope over cycles. [A]"""
    plant = search.plant
    runs = plant.repeated([point], cycles, N_FINAL, FINAL_SEED)[0]
    errors = [plant.data.envelopes[c][::ENVELOPE_STEP] - runs[c].envelopes.mean(axis=0) for c in cycles]
    return float(np.sqrt(np.mean([np.mean(e[settled(plant) :] ** 2) for e in errors])))


def _gain(search: Search, before: Model, after: Model) -> Gain:
    floor = np.sqrt(
        np.mean([np.mean(search.noise.of(c).envelope_sd[settled(search.plant) :] ** 2) for c in search.heldout])
        * (1.0 + 1.0 / N_FINAL)
    )
    k_before, k_after = (tuple(round(m.fit.point.get(n, 0.0), 5) for n in FAULTS) for m in (before, after))
    return Gain(
        envelope_error(search, before.fit.point, search.train),
        envelope_error(search, after.fit.point, search.train),
        envelope_error(search, before.fit.point, search.heldout),
        envelope_error(search, after.fit.point, search.heldout),
        float(floor),
        k_before,
        k_after,
        sum(x > FAULT_ALARM for x in k_before),
        sum(x > FAULT_ALARM for x in k_after),
    )
