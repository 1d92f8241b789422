"""Which laws the records need, and what cannot be told from each: forward and backward on held-out blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ema.discrepancy.axis.balance.laws.along import ANY, LINES
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, BY_RECORD_NAME, Law
from ema.discrepancy.axis.balance.laws.links import LINKS

from .found import Balance, Term
from .members import N_FINER, draw_members, fit_sizes, gains_of, members_around
from .needed import ALARM, SIMPLER, Asked, chance, families_held, is_needed, simpler_families
from .regression import Corrected, Plain, Regression, is_machine, regress
from .rows import Rows

MOST_LAWS = 8  # a series of lines is one
MOST_LINES = 16  # of one series: each takes a tenth at least of what those before it left
SELDOM = 0.05  # share of draws that another law must win to be one that the records cannot tell
N_DRAWS = 400  # of blocks, to see how often a law wins
N_NEAR = 16  # members of a family that are asked how often each leaves least
EQUAL = 1e-9  # share by which rounding tells two columns apart that are one on these records: the first is taken


def choose_laws(found: Rows, plain: Plain, every: Sequence[Law], given: Sequence[Law] = ()) -> Balance:
    """Forward and backward selection beside the laws that are `given`.

    Each step is a test of two models, and such tests can go round: A by B, B by C, C by A. Of those that follow each
    other in a circle the one that leaves least of held-out blocks is taken.
    """
    n = int(found.whole.sum())
    drive = float(np.var(found.drive[found.whole]))
    asked = Asked.of(drive * n, every)
    base = regress(found, plain, given)
    model, declared = base, {law.key for law in given}
    met = [model]
    while _n_laws(model) < MOST_LAWS:
        trials = _try_each(found, plain, model, [law for law in every if not _is_full(model, law)])
        # not the best of all alone: a share of the load itself takes much of any drive, and blocks disagree on it
        best = _choose_simplest([r for r in trials if is_needed(r, model, asked)], asked)
        if best is None:
            break
        model = _revise(found, plain, best, every, asked)
        if circle := _since(met, model):
            model = min(circle, key=lambda r: r.loss)
            break
        met.append(model)
    for _ in range(2 * MOST_LAWS):
        fewer = _exchange(found, plain, model, every, asked)
        if fewer is None:
            break
        model = fewer
    model = _best_members(found, plain, model, every)
    terms = tuple(_term(found, plain, model, law, every, asked) for law in model.laws if law.key not in declared)
    return Balance(
        model, Corrected(model.coefficients, model.covariance()), plain, terms, drive,
        float(np.mean((found.y - plain.inertia * found.alpha)[found.whole] ** 2)),
        base.loss / n, model.loss / n, float(np.mean(found.sigma[found.whole] ** 2)),
        given=tuple(given),
    )  # fmt: skip


def _since(met: Sequence[Regression], model: Regression) -> Sequence[Regression]:
    """Those met since a model of the same laws, that one with them; none where there was none."""
    sets = [{law.key for law in r.laws} for r in met]
    own = {law.key for law in model.laws}
    return met[sets.index(own) :] if own in sets else ()


def _n_laws(model: Regression) -> int:
    """Laws of a model, a series of lines as one."""
    return len({law.family if law.family in LINES else law.key for law in model.laws})


def _is_full(model: Regression, law: Law) -> bool:
    """Whether the series that a line belongs to has all the lines it may have."""
    return law.family in LINES and sum(own.family == law.family for own in model.laws) >= MOST_LINES


def _choose_simplest(trials: Sequence[Regression], asked: Asked) -> Regression | None:
    """The trial that leaves least; of two of which one holds the other, the larger only where it needs to be."""
    best = min(trials, key=lambda r: r.loss, default=None)
    if best is None:
        return None
    simpler = [r for r in trials if r.laws[-1].family in simpler_families(best.laws[-1].family)]
    return _smallest(simpler, best, asked) or best


def _smallest(trials: Sequence[Regression], best: Regression, asked: Asked) -> Regression | None:
    """Of those beside which the best is not needed, the one with fewest coefficients."""
    return min((r for r in trials if not is_needed(best, r, asked)), key=lambda r: (_size(r), r.loss), default=None)


def _try_each(found: Rows, plain: Plain, model: Regression, every: Sequence[Law]) -> list[Regression]:
    """The model with one law more: of each family that is not in it the member that fits best, if that is a machine."""
    have = {law.key for law in model.laws}
    single = {law.family for law in model.laws if law.family not in LINES}
    single |= {other for law in model.laws for other in families_held(law.family) if other not in LINES}
    have |= {law.key.removesuffix(BY_RECORD) for law in model.laws}
    members: dict[str, list[Law]] = {}
    for law in every:
        if law.key not in have and law.family not in single:
            members.setdefault(law.family, []).append(law)
    trials = [regress(found, plain, _add(model, _best(found, model, own))) for own in members.values()]
    return [r for r in trials if is_machine(model, r, plain)]


def _add(model: Regression, law: Law) -> list[Law]:
    """The laws of a model and one more; that one by record takes the place of the same for all."""
    return [*(own for own in model.laws if law.repeats is None or own.key != law.repeats.key), law]


def _best(found: Rows, model: Regression, members: Sequence[Law]) -> Law:
    """The member of a family whose columns take most of what is left, or one that lies between two members."""
    best = _best_of(found, model, members)
    for k in range(1, N_FINER + 1):
        if best.finer is not None:
            best = _best_of(found, model, [best, *best.finer(0.5**k)])
    return best


def _best_of(found: Rows, model: Regression, members: Sequence[Law]) -> Law:
    if len(members) == 1:
        return members[0]
    gains = gains_of(found, model, members)
    return members[int(np.argmax(gains >= (1.0 - EQUAL) * gains.max()))]


def _best_members(found: Rows, plain: Plain, model: Regression, every: Sequence[Law]) -> Regression:
    """With that member of each family that fits best beside the laws that came after it.

    What acts on friction by load depends on its size: of such a family each member is fitted to the end. One of another
    name takes the place of a law that seldom leaves less.
    """
    for law in [own for own in model.laws if own.family not in LINES]:
        without = regress(found, plain, [own for own in model.laws if own.key != law.key])
        members = [own for own in every if own.family == law.family] or [law]
        same = [own for own in members if own.name == law.name]
        best = _best(found, without, same or [law]) if law.among is None else fit_sizes(found, without, same)
        other = regress(found, plain, _add(without, best))
        model = other if other.loss < model.loss else model
        for own in members if law.needs_acting else ():
            other = regress(found, plain, _add(without, own))
            if _wins(law.name, model, {own.key: other})[law.name] <= SELDOM and is_machine(model, other, plain):
                model = other
    return model


def _revise(found: Rows, plain: Plain, model: Regression, every: Sequence[Law], asked: Asked) -> Regression:
    """Without laws that later ones made superfluous, or with another in their place that does clearly better."""
    for law in model.laws[:-1]:
        if law.family in (*LINES, LINKS):
            continue  # lines stand beside each other, and a neighbour is declared
        without = regress(found, plain, [own for own in model.laws if own.key != law.key])
        if not is_needed(model, without, asked):
            model = without
            continue
        trials = _try_each(found, plain, without, every)
        simpler = [r for r in trials if r.laws[-1].family in simpler_families(law.family)]
        if (smaller := _smallest(simpler, model, asked)) is not None:
            model = smaller
            continue
        other = _choose_simplest(trials, asked)
        if other is not None and other.laws[-1].key != law.key and is_needed(other, model, asked):
            model = other
    return model


def _exchange(found: Rows, plain: Plain, model: Regression, every: Sequence[Law], asked: Asked) -> Regression | None:
    """A model of fewer coefficients or laws that leaves no more: one law may do what several stood in for."""
    for law in model.laws:
        without = regress(found, plain, [own for own in model.laws if own.key != law.key])
        ways = [r for r in _simpler_ways(found, plain, without, law, every) if _size(r) < _size(model)]
        if (smaller := _smallest(ways, model, asked)) is not None:
            return smaller
    single = [law for law in model.laws if law.family not in (*LINES, LINKS)]
    for trial in _try_each(found, plain, model, every) if len(single) > 1 else ():
        reduced = trial
        for law in single:
            without = regress(found, plain, [own for own in reduced.laws if own.key != law.key])
            if not is_needed(reduced, without, asked):
                reduced = without
        if _size(reduced) < _size(model) and not is_needed(model, reduced, asked):
            return reduced
        if len(reduced.laws) == len(model.laws) and is_needed(reduced, model, asked):
            return reduced
    return None


def _size(model: Regression) -> tuple[int, int]:
    """Coefficients, and laws that they belong to."""
    return len(model.coefficients), len(model.laws)


def _term(found: Rows, plain: Plain, model: Regression, law: Law, every: Sequence[Law], asked: Asked) -> Term:
    """How sure a law is beside all that could stand in its place."""
    without = regress(found, plain, [own for own in model.laws if own.key != law.key])
    others = [r for r in _try_each(found, plain, without, every) if r.laws[-1].key != law.key]
    siblings: dict[str, list[Law]] = {}
    for other in every:
        if other.family == law.family and other.name != law.name:
            siblings.setdefault(other.name, []).append(other)
    same = [regress(found, plain, _add(without, _best(found, without, own))) for own in siblings.values()]
    rivals: dict[str, Regression] = {}
    for r in [*others, *same, *_simpler_ways(found, plain, without, law, every)]:
        own = r.laws[-1].name.removesuffix(BY_RECORD_NAME)
        asks = asked if r.laws[-1].family == ANY else replace(asked, whole=0.0)  # a form that is inexact is a name
        if law.family in simpler_families(r.laws[-1].family) and not is_needed(r, model, asks):
            continue  # it can do what this law does and more, and need not
        if own != law.name.removesuffix(BY_RECORD_NAME) and (own not in rivals or r.loss < rivals[own].loss):
            rivals[own] = r
    share = _wins(law.name, model, rivals)
    seen: set[str] = set()
    while doubtful := [name for name in rivals if share[name] > SELDOM and name not in seen]:
        seen |= {*doubtful}
        for name in doubtful:
            if _is_ruled_out(found, plain, model, law, rivals[name]):
                del rivals[name]
        share = _wins(law.name, model, rivals)
    alike = {name: wins for name, wins in share.items() if name != law.name and wins > SELDOM}
    common = float(np.mean([model.shared(law, r) for r in others])) if others else 0.0
    power = (without.loss - model.loss) / max(int(found.whole.sum()), 1)
    members = _near_members(found, plain, model, without, law, every)
    return Term(law, power, share[law.name], alike, common, tuple(rivals[name] for name in alike), members)


def _near_members(
    found: Rows, plain: Plain, model: Regression, without: Regression, law: Law, every: Sequence[Law]
) -> tuple[tuple[Regression, float], ...]:
    """Fits with another member of a law's family in its place, and how often each leaves least.

    Where members stand for all between them, those that lie between this one and the next too.
    """
    if law.family in LINES and law.finer is None:
        return ()
    same = [own for own in every if own.family == law.family and own.name == law.name]
    if law.among is not None:
        near = members_around(found, without, law, same)
    else:
        same += [own for k in range(1, N_FINER + 1) if law.finer is not None for own in law.finer(0.5**k)]
        near = [same[k] for k in np.argsort(-gains_of(found, without, same))[:N_NEAR]] if same else []
    near = [law, *(own for own in near if own.key != law.key)]
    drawn = np.bincount(draw_members(found, without, near, N_DRAWS), minlength=len(near)) / N_DRAWS
    return tuple((regress(found, plain, _add(without, near[k])), float(drawn[k])) for k in np.flatnonzero(drawn) if k)


def _simpler_ways(found: Rows, plain: Plain, without: Regression, law: Law, every: Sequence[Law]) -> list[Regression]:
    """In place of a law that bends what it holds: one that it holds and one more, or that one alone."""
    if law.family not in SIMPLER:
        return []
    simpler = [own for own in every if own.family in simpler_families(law.family)]
    begun = [without]
    for family in families_held(law.family):
        if held := [own for own in simpler if own.family == family]:
            begun.append(regress(found, plain, _add(without, _best(found, without, held))))
    return [r for own in begun for r in _try_each(found, plain, own, simpler)]


def _wins(name: str, model: Regression, rivals: Mapping[str, Regression]) -> dict[str, float]:
    """How often each leaves least, over draws of blocks; `name` is the model itself."""
    losses = np.stack([model.losses, *(r.losses for r in rivals.values())])
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(losses.shape[1], np.full(losses.shape[1], 1.0 / losses.shape[1]), N_DRAWS)
    left = losses @ drawn.T
    first = left <= (1.0 + EQUAL) * left.min(axis=0)
    shares = (first / first.sum(axis=0)).mean(axis=1)  # equals share a draw
    return dict(zip([name, *rivals], shares.tolist(), strict=True))


def _is_ruled_out(found: Rows, plain: Plain, model: Regression, law: Law, rival: Regression) -> bool:
    """Whether beside the rival this law is needed, and beside this law the rival is not.

    Draws of blocks compare what each leaves; of few blocks that says little, where a fit of both says which one is idle
    (Davidson and MacKinnon, "Several tests for model specification in the presence of alternative hypotheses",
    Econometrica 49, 1981).
    """
    other = rival.laws[-1]
    both = regress(found, plain, [*model.laws, other])
    beside = regress(found, plain, [*rival.laws, law])
    return chance(beside, rival, [law]) < ALARM <= chance(both, model, [other])
