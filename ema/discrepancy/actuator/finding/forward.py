"""Forward selection: effects are added one at a time while they are real, and earlier ones exchanged.

Of those that promise most the best few are fitted, with what resembles them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.actuator.fitting.candidates import Way
from ema.discrepancy.actuator.fitting.comparators import PLAIN
from ema.discrepancy.actuator.fitting.conditions import Conditions
from ema.discrepancy.actuator.fitting.fit import fit
from ema.discrepancy.actuator.fitting.model import CHANCE, DISTANT, FAR, NEAR, Model, strip
from ema.discrepancy.actuator.simulating.noise import Noise, Verdict

from .ridge import sort_by_nearness, subtract_common, walk_ridge
from .screening import AT_LEAST, Screened, find_look_alikes, rank_by_simulation, rank_to_first_order, start_with
from .verdicts import NEARLY, begin_again, judge_closely, settle_at_minimum, take_bench_conditions
from .weighing import (
    SAME,
    SLACK,
    WORTH_IT,
    does_it,
    is_alike,
    is_credible,
    is_enough,
    leaves_noise,
    may_be_nothing,
    within_reach,
)

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

STRONG = 0.6  # share of what is left that a further effect must take when there is enough already
NEW_NOISE = 0.5  # share of what was left when the noise was estimated, from which it is estimated anew
CLOSE = 0.5  # share of what was left, from which another turn is not worth it
N_OWN = 3  # models near the data that are weighed by noise of their own
N_EXCHANGED = 2  # likeliest others that are tried in place of an earlier effect where a rest is left
N_REFINED = 4
WORTH_A_FIT = 0.1  # share of the squared residual beyond noise that a candidate must promise, to first order
NO_WORSE = 1.5  # times the squared residual of the best start, from which a start with fewer faults is not preferred
REACHED = 1.5  # misfit of a model that may be the right one, but for noise that is not its own
NEARLY_ALL = 0.01  # share of what there was to explain, up to which a rival may still leave it for want of iterations
NEAR_NOISE = 0.05  # excess below which a fit need not go on


def add_effects(
    search: Search, before: Model, after: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`after` with as many further effects as are real."""
    left = after.excess
    while not v.is_noise and not after.is_full:
        enough = is_enough(after, before)
        screened = rank_to_first_order(search, after)
        models = fit_with_one_more(search, after, screened)
        needed = max(STRONG * after.excess, CHANCE) if enough else WORTH_IT * after.excess
        real = _keep_real(search, models, after, needed)
        if not real and needed <= after.excess < FAR:
            real = _keep_real(search, fit_with_one_more(search, after, screened, models), after, needed)
        if not real and enough:
            real = _keep_leaving_noise(search, models, after)
        if not real and not enough and after.excess > DISTANT:
            real = keep_leading_on(search, models, after)
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
        _tell_rivals(alike, after, rivals)
        after, v = judge_closely(search, after, search.verdict(after))
        if not v.is_noise:
            after, v = take_bench_conditions(search, after, v, PLAIN)
        if not v.is_noise and after.excess < DISTANT:  # far from noise it is not what is flat that is missing
            is_near = after.excess < NEAR
            after, v = settle_at_minimum(search, after, v, alike) if is_near else begin_again(search, after, v)
        search.say(f"{' + '.join(after.names)}: p = {v.p_value:.2g}")
    return after, v


def _tell_rivals(alike: list[tuple[str, ...]], model: Model, rivals: Sequence[Model]) -> None:
    """Add the rivals of the last effect of `model` to those of each; what came together with it has none."""
    alike.extend(() for _ in range(len(model.effects) - 1 - len(alike)))
    alike.append(tuple(m.names[-1] for m in rivals))


def try_other_first_effects(
    search: Search, before: Model, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`model`, or one that begins with another first effect, simulated since first order had promised little of it.

    A commutation that is far off promises less than a torque line that follows what it does.
    """
    if v.is_noise or before.excess >= FAR or is_enough(model, before):
        return model, v
    singly = [m for m in search.tried if len(m.effects) == 1]
    found = _keep_owed_to_last(
        search, fit_with_one_more(search, before, rank_to_first_order(search, before), singly), before
    )
    if not found or found[0].excess > CLOSE * model.excess:
        return model, v
    noise, conditions = search.noise, Conditions.of(search.plant)
    sets: list[tuple[str, ...]] = []
    _tell_rivals(sets, found[0], [m for m in found[1:] if is_alike(m, found[0])])
    made, w = judge_closely(search, found[0], search.verdict(found[0]))
    made, w = add_effects(search, before, made, w, sets)
    if not w.is_noise and made.excess > CLOSE * model.excess:
        search.noise = noise
        conditions.take(search.plant)
        return model, v
    search.say(f"{' + '.join(made.names)} instead of {' + '.join(model.names) or 'nothing'}")
    alike[:] = sets
    return made, w


def exchange_earlier_effects(
    search: Search, model: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
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


def _keep_real(search: Search, models: Sequence[Model], after: Model, needed: float) -> list[Model]:
    """Of models with one more effect than `after`, those in which it is real: credible, and the gain is its own."""
    gaining = [m for m in models if after.excess - m.excess >= needed]
    return _keep_owed_to_last(search, gaining, after) or _weigh_by_own_noise(
        search, [m for m in models if m.heldout < after.heldout + SAME], after
    )


def _keep_owed_to_last(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models with a credible last effect to which they owe what they gain over `after`."""
    return [m for m in models if is_credible(m) and does_it(search, m, after)]


def keep_leading_on(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """The model that owes most to its last effect, where a further one takes enough for both.

    Where faults stand for what two effects do, each of these gains little before the other is there.
    """
    gaining = [m for m in models[:1] if not m.is_full and m.excess < (1.0 - WORTH_A_FIT) * after.excess]
    for m in _keep_owed_to_last(search, gaining, after):
        two = fit_with_one_more(search, m, rank_to_first_order(search, m))
        if two and two[0].excess < (1.0 - WORTH_IT) ** 2 * after.excess:
            return [m]
    return []


def _keep_leaving_noise(search: Search, models: Sequence[Model], after: Model) -> list[Model]:
    """Models that leave noise where `after` leaves hardly more, as no law of another form makes it.

    The misfit of noise itself is not one but for the noise that it was estimated from.
    """
    gaining = [m for m in models if after.heldout - m.heldout > 2.0 * CHANCE]
    return [m for m in _keep_owed_to_last(search, gaining, after) if search.verdict(m).is_noise]


def _weigh_by_own_noise(search: Search, models: list[Model], after: Model) -> list[Model]:
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


def fit_with_one_more(
    search: Search, model: Model, screened: Sequence[Screened], known: Sequence[Model] = ()
) -> list[Model]:
    """The best models with one more effect of those screened, best first.

    With `known`, those that first order has led to, candidates that are not among them are simulated instead.
    """
    tried = {m.effects[-1].way for m in known}
    screened = [s for s in screened if s.candidate.way not in tried]
    if known or model.excess > FAR:
        screened = rank_by_simulation(search, model, screened)
    # Far from the data what stands for faults is no nearer to it than what promises most, and takes longer to fit.
    in_turn = [_fit_for_several_faults, _fit_most_promising]
    refined: dict[Way, Model] = {}
    for fit_some in reversed(in_turn) if model.excess > DISTANT else in_turn:
        refined |= fit_some(search, model, screened, refined)
    if not refined:
        return []
    best = min(refined.values(), key=lambda m: m.heldout)
    near = model.excess < FAR
    for leader in _choose_leaders(model, refined, best):
        for s in find_look_alikes(search, model, leader, screened, set(refined), only_there=near):
            m = _fit_rival(search, leader, s) if near else _fit_candidate(search, model, s, within_reach(leader))
            way = s.candidate.way
            refined[way] = min(m, refined.get(way, m), key=lambda x: x.heldout)
    # A rival is out only if it leaves more when fitted as well as the best, or promises to.
    for way, m in _find_near_best(refined, model):
        again = search.model(m.effects, m.fit.free, m.fit.point, None, 4, within_reach(best))
        refined[way] = min(m, again, key=lambda x: x.heldout)
    ranked = sorted(refined.values(), key=lambda m: m.heldout)
    return list({m.names[-1]: m for m in reversed(ranked)}.values())[::-1]  # of each effect the better way


def _choose_leaders(model: Model, refined: Mapping[Way, Model], best: Model) -> list[Model]:
    """The best, and the best that stands for several faults if it does as well: from these no fit finds its rivals."""
    standing = [m for m in refined.values() if model.shows_faults_of(m.effects[-1]) and is_alike(m, best)]
    instead = min(standing, key=lambda m: m.heldout, default=best)
    return [best] if instead is best else [best, instead]


def _fit_for_several_faults(
    search: Search, model: Model, screened: Sequence[Screened], known: Mapping[Way, Model]
) -> dict[Way, Model]:
    """One cause for several faults, tried whatever it promises, since the faults hide that.

    Unless another one takes nearly all by itself. Once one leaves noise, the others are asked from where that is, if
    they look like it.
    """
    if any(m.excess < NEARLY_ALL * model.excess for m in known.values()):
        return {}
    found: dict[Way, Model] = {}
    for s in sort_by_nearness(search, model, [s for s in screened if model.shows_faults_of(s.candidate)]):
        if s.candidate.way not in {*known, *found}:
            best = min([*known.values(), *found.values()], key=lambda m: m.heldout, default=None)
            found[s.candidate.way] = m = _fit_candidate(search, model, s, within_reach(best) if best else np.inf)
            if leaves_noise(search, m):
                break
    return found


def _fit_most_promising(
    search: Search, model: Model, screened: Sequence[Screened], known: Mapping[Way, Model]
) -> dict[Way, Model]:
    """Those that promise most, one at least if none is known, until one leaves noise.

    Before them what is plain to see in the record, whatever a simulation of it beside the wrong faults promises.
    """
    cost = model.fit.cost
    worth = max(WORTH_A_FIT * (cost - cost / model.fit.misfit), AT_LEAST * cost)
    found: dict[Way, Model] = {}
    if any(leaves_noise(search, m) for m in known.values()):
        return found
    guessed: set[str] = set()
    for s in sorted(screened, key=lambda s: not s.candidate.is_seen):
        if not s.candidate.is_seen:
            if (known or found) and cost - s.promised < worth:
                break
            if len(guessed) >= N_REFINED or (
                (known or found) and _stands_alone(search, {**known, **found}, s.promised)
            ):
                break
        if s.candidate.way not in {*known, *found}:
            if not s.candidate.is_seen:
                guessed.add(s.candidate.effect)
            best = min(found.values(), key=lambda m: m.heldout, default=None)
            found[s.candidate.way] = m = _fit_candidate(search, model, s, within_reach(best) if best else np.inf)
            if leaves_noise(search, m):
                break
    return found


def _fit_candidate(search: Search, model: Model, s: Screened, to_beat: float = np.inf) -> Model:
    beside = [c for c in s.candidate.beside if c.effect not in model.names]
    seen = {name: x for c in beside for name, x in c.probes()[0].items()}
    added = (*beside, s.candidate)
    frees = (*model.fit.free, *(f for c in added for f in c.frees))
    starts = [s.start, start_with(search, model, s.candidate, dict.fromkeys(FAULTS, 0.0))]
    start, cost = search.better([{**at, **seen} for at in starts], model)
    if model.shows_faults_of(s.candidate):
        # One effect for several faults, or for what they have in common, is the simpler cause; noise in the
        # columns would leave the faults there.
        less = (dict.fromkeys(s.candidate.faults, 0.0), subtract_common(model, s.candidate))
        nearer, _ = search.better([{**start_with(search, model, s.candidate, rest), **seen} for rest in less], model)
        # From there the effect alone goes as far as it can.
        alone = fit(search.plant, search.noise, s.candidate.frees, nearer, search.train, n_iterations=3)
        simpler, simpler_cost = search.better([alone.point], model)
        if simpler_cost < NO_WORSE * cost:
            start = simpler
    made = search.model((*model.effects, *added), frees, start, model.fit.columns, 3, to_beat)
    return walk_ridge(search, model, made, s.candidate, to_beat) if model.shows_faults_of(s.candidate) else made


def _fit_rival(search: Search, best: Model, s: Screened) -> Model:
    """A rival in the place of the last effect of `best`, begun from where that is."""
    effects, frees, _ = strip(best, best.effects[-1])
    free = (*frees, *s.candidate.frees)
    return search.model((*effects, s.candidate), free, s.start, best.fit.columns, 3, within_reach(best))


def _find_near_best(refined: dict[Way, Model], model: Model) -> list[tuple[Way, Model]]:
    """The models near the best, by what there was to explain too; none if the best stands alone without a rest."""
    ranked = sorted(refined.items(), key=lambda item: item[1].heldout)
    best = ranked[0][1]
    within = max(2.0 * best.excess + 0.2, NEARLY_ALL * model.excess)
    near = [(name, m) for name, m in ranked[:3] if m.excess < within and not m.fit.given_up]
    return near if len(near) > 1 or best.excess > NEAR_NOISE else []


def _stands_alone(search: Search, refined: Mapping[Way, Model], promised: float) -> bool:
    """Whether one leaves nearly nothing, and what is left to try promises far less."""
    n = sum(len(search.plant.data.y[c]) for c in search.train)
    reached = min(m.fit.misfit for m in refined.values())
    return reached < REACHED and promised / n > 3.0 * reached + 0.5
