"""Forward selection: effects are added one at a time while they are real, and earlier ones exchanged."""

from __future__ import annotations

from collections.abc import Sequence

from .comparators import PLAIN, take_step
from .noise import Noise, Verdict
from .screening import promising
from .search import CHANCE, FAR, Model, Search
from .select import NEARLY_ALL, extend
from .verdicts import NEARLY, as_on_the_bench, at_the_minimum, surely
from .weighing import SLACK, WORTH_IT, does_it, is_alike, is_credible, is_enough, may_be_nothing

MAX_EFFECTS = 3
STRONG = 0.6  # share of what is left that a further effect must take when there is enough already
NEW_NOISE = 0.5  # share of what was left when the noise was estimated, from which it is estimated anew
CLOSE = 0.5  # share of what was left, from which another turn is not worth it
SAME = 0.05  # difference in held-out misfit up to which fewer causes are preferred
NEAR, N_OWN = 1.0, 3  # excess up to which so many models are weighed by noise of their own
N_EXCHANGED = 2  # likeliest others that are tried in place of an earlier effect where a rest is left


def grown(
    search: Search, before: Model, after: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`after` with as many further effects as are real."""
    left = after.excess
    while not v.is_noise and len(set(after.names) - {"torque_line"}) < MAX_EFFECTS:  # a second line is no further cause
        enough = is_enough(after, before)
        screened = promising(search, after)
        models = extend(search, after, screened)
        needed = max(STRONG * after.excess, CHANCE) if enough else WORTH_IT * after.excess
        real = _real(search, models, after, needed)
        if not real and needed <= after.excess < FAR:
            real = _real(search, extend(search, after, screened, models), after, needed)
        if not real and enough:
            real = _leaving_noise(search, models, after)
        if not real:
            break
        after, *rivals = [m for m in real if is_alike(m, real[0])]
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
        rivals = [m for m in rivals if is_alike(m, after) and not may_be_nothing(search, m, m.effects[-1])]
        alike.append(tuple(m.names[-1] for m in rivals))
        after, v = surely(search, after, search.verdict(after))
        if not v.is_noise:
            after, v = as_on_the_bench(search, after, v, PLAIN)
        if not v.is_noise:
            after, v = at_the_minimum(search, after, v)
        search.say(f"{' + '.join(after.names)}: p = {v.p_value:.2g}")
    return after, v


def instead_of_all(
    search: Search, before: Model, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`model`, or one that begins with another first effect, simulated since first order had promised little of it.

    A commutation that is far off promises less than a torque line that follows what it does.
    """
    if v.is_noise or before.excess >= FAR or is_enough(model, before):
        return model, v
    singly = [m for m in search.tried if len(m.effects) == 1]
    found = _by_themselves(search, extend(search, before, promising(search, before), singly), before)
    if not found or found[0].excess > CLOSE * model.excess:
        return model, v
    noise, step, late = search.noise, search.plant.step, search.plant.late
    sets: list[tuple[str, ...]] = [tuple(m.names[-1] for m in found[1:] if is_alike(m, found[0]))]
    made, w = surely(search, found[0], search.verdict(found[0]))
    made, w = grown(search, before, made, w, sets)
    if not w.is_noise and made.excess > CLOSE * model.excess:
        search.noise, search.plant.late = noise, late
        take_step(search.plant, step)
        return model, v
    search.say(f"{' + '.join(made.names)} instead of {' + '.join(model.names) or 'nothing'}")
    alike[:] = sets
    return made, w


def exchanged(search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]) -> tuple[Model, Verdict]:
    """`model`, or one with another effect in place of an earlier one, which was chosen before the others were there."""
    for effect in model.effects[:-1]:
        place = model.effects.index(effect)
        there = [m for m in search.tried if m.effects and m.names[:-1] == model.names[:place]]
        beside = [m for m in there if m.names[-1] not in model.names]
        best = {m.names[-1]: m for m in sorted(beside, key=lambda m: -m.heldout)}
        for rival in sorted(best.values(), key=lambda m: m.heldout)[:N_EXCHANGED]:
            made = search.instead(model, effect, rival)
            if made.excess < CLOSE * model.excess and is_credible(made):
                search.say(f"{rival.names[-1]} instead of {effect.effect}")
                del alike[place]
                alike.append(())
                model, v = made, search.verdict(made)
                break
    return model, v


def _real(search: Search, models: Sequence[Model], after: Model, needed: float) -> list[Model]:
    """Of models with one more effect than `after`, those in which it is real: credible, and the gain is its own."""
    gaining = [m for m in models if after.excess - m.excess >= needed]
    return _by_themselves(search, gaining, after) or _with_own_noise(
        search, [m for m in models if m.heldout < after.heldout + SAME], after
    )


def _by_themselves(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models with a credible last effect to which they owe what they gain over `after`."""
    return [m for m in models if is_credible(m) and does_it(search, m, after)]


def _leaving_noise(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models that leave noise where `after` leaves hardly more, as no law of another form makes it.

    The misfit of noise itself is not one but for the noise that it was estimated from.
    """
    gaining = [m for m in models if after.heldout - m.heldout > 2.0 * CHANCE]
    return [m for m in _by_themselves(search, gaining, after) if search.verdict(m).is_noise]


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
        if m.excess < CLOSE * after.excess and less > CHANCE and is_credible(m):
            found.append((m, search.noise))
    found.sort(key=lambda entry: entry[0].heldout)
    search.noise = found[0][1] if found else here
    return [m for m, _ in found]
