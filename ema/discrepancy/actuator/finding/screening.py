"""What candidates promise beside a model, to first order from probes or simulated, and which look like each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.fitting.candidates import Candidate, Way, candidates
from ema.discrepancy.actuator.fitting.fit import (
    SEED,
    bounds,
    residuals,
    residuals_at,
    solve_within_bounds,
    stacked_jacobian,
    step_to,
)
from ema.discrepancy.actuator.fitting.free import Free
from ema.discrepancy.actuator.fitting.model import DISTANT, FAR, N_GLANCE, N_GLANCE_FAR, Model, strip
from ema.discrepancy.plant import Point

from .weighing import within_reach

if TYPE_CHECKING:
    from ema.discrepancy.actuator.fitting.search import Search

N_PROBE, N_PROBE_HIDDEN = 8, 24  # seeds of a column that only screens; of one that is hardly felt
WIDER = 3.0  # times the step of an effect that is hardly felt
FELT = 0.5  # cosine between halves of the seeds, below which a column is mostly noise
DT_PROBE = 2e-6  # [s] step of a simulation that only screens: its columns are within 4 % (12 % for dead time)
AT_LEAST = 0.01  # share of the whole squared residual that it must promise
COLLINEAR = 0.8  # cosine from which two effects look like each other
CURVED = 0.2  # share of what an effect does, by which a start with another in its place may be off
N_NEAREST = 2  # in the place of several effects, that are fitted
RESEMBLING = 0.3  # cosine by probes at the nominal point, from which another is tried where the fit is


class Screened(NamedTuple):
    """A candidate's promise: squared residual on training cycles to first order, and where to begin a fit."""

    promised: float
    candidate: Candidate
    start: Point


def rank_to_first_order(search: Search, model: Model) -> list[Screened]:
    """All that may stand beside the effects of `model`, by what it promises to first order."""
    line = "torque_line" if "cogging" in model.names else "cogging"
    plant = search.plant
    found = candidates(plant.plant, plant.data, search.torques(model), line, plant.resonance, plant.delays)
    return _rank(search, model, [c for c in found if c.effect not in model.names])


def _rank(search: Search, model: Model, found: Sequence[Candidate]) -> list[Screened]:
    """What each candidate promises to first order next to all that `model` has free, best first."""
    found = probe(search, found)
    f = model.fit
    own = stacked_jacobian(search.noise, f.free, f.columns, search.train)
    r = np.concatenate([f.residuals[c] for c in search.train])
    low, high = bounds(f.free, f.point)
    ranked = []
    for c in found:
        J = columns_of(search, c)
        c_low, c_high = c.limits()
        step, promised = solve_within_bounds(
            np.concatenate([own, J], axis=1), r, np.concatenate([low, c_low]), np.concatenate([high, c_high])
        )
        start = {**step_to(f.point, f.free, step[: len(f.free)]), **c.start(step[len(f.free) :])}
        ranked.append(Screened(promised, c, start))
    ranked = _begin_where_shown(search, model, ranked)
    ranked = [s for s in ranked if not any(_does_as_well(t, s, AT_LEAST * float(r @ r)) for t in ranked)]
    return sorted(ranked, key=_promised)


def _begin_where_shown(search: Search, model: Model, ranked: Sequence[Screened]) -> list[Screened]:
    """Candidates that the record itself shows, begun there where that, simulated, leaves less than promised.

    Less what the parameters that `model` has free take of it to first order: these had stood for what was not there.

    The residual torque is known by the recorded angle. Where something else moves the rotor besides, a line that is
    simulated without it is out of phase: its column promises little, and another order more. What a commutation does
    that is off with the resolver's zero is even in it, so that a column promises nothing.
    """
    f, noise = model.fit, search.noise
    starts = [[{**f.point, **at} for at in s.candidate.shown_starts()] for s in ranked]
    points = [point for of in starts for point in of]
    left = iter(residuals_at(search.plant, noise, points, search.train, N_GLANCE, SEED) if points else ())
    own, limits = stacked_jacobian(noise, f.free, f.columns, search.train), bounds(f.free, f.point)
    found = []
    for s, of in zip(ranked, starts, strict=True):
        for point in of:
            at = next(left)
            step, promised = solve_within_bounds(own, np.concatenate([at[c] for c in search.train]), *limits)
            s = min(s, Screened(promised, s.candidate, {**point, **step_to(f.point, f.free, step)}), key=_promised)
        found.append(s)
    return found


def _promised(s: Screened) -> float:
    return s.promised


def probe(search: Search, found: Sequence[Candidate]) -> list[Candidate]:
    """Fill in the columns (per unit) of what was not probed before; what is hardly felt comes with longer steps."""
    new = [c for c in found if c.key not in search.probed]
    hidden = _simulate_probes(search, new, N_PROBE)
    _simulate_probes(search, [c.wider(WIDER) for c in new if c.key in hidden], N_PROBE_HIDDEN)
    return [replace(search.probed[c.key], shown=c.shown) for c in found]


def _simulate_probes(search: Search, found: Sequence[Candidate], n_seeds: int) -> set[str]:
    """Simulate probes; keys of candidates whose columns are mostly noise, as two halves of the seeds tell."""
    if not found:
        return set()
    first = search.plant.first
    points = [{}, *(p for c in found for p in c.probes())]
    here, *there = search.plant.repeated(points, first, n_seeds, SEED, (DT_PROBE,))
    probed, hidden = iter(there), set()
    for c in found:
        search.probed[c.key] = c
        for j, amount in enumerate(c.amounts):
            runs = next(probed)
            halves = []
            for motion, cycle in enumerate(first):
                column = (runs[cycle].features - here[cycle].features) / amount
                search.columns[motion, c.probe_name(j)] = column.mean(axis=0)
                white = search.noise.motions[motion].white(column)
                halves.append([white[half::2].mean(axis=0) for half in (0, 1)])
            a, b = np.concatenate(halves, axis=1)
            if a @ b < FELT * np.linalg.norm(a) * np.linalg.norm(b):
                hidden.add(c.key)
    return hidden


def start_with(search: Search, model: Model, c: Candidate, faults: Point) -> Point:
    """A start with some faults of `model` at other values, where the effect stands for what that takes away."""
    return _starts_with(search, model, [c], faults)[0]


def _starts_with(search: Search, model: Model, found: Sequence[Candidate], faults: Point) -> list[Point]:
    point = {**model.fit.point, **faults}
    left = residuals(search.plant, search.noise, point, search.train, N_GLANCE)
    r = np.concatenate([left[cycle] for cycle in search.train])
    return [{**point, **c.start(solve_within_bounds(columns_of(search, c), r, *c.limits())[0])} for c in found]


def rank_by_simulation(search: Search, model: Model, screened: Sequence[Screened]) -> list[Screened]:
    """Candidates by what their starts leave when simulated, where first order promises little.

    So far from the data, where faults stand for anything. Near it first order misses what has a threshold, as dead time
    that acts where a current is small: there sizes are tried beside the faults, in steps that show a microsecond.
    """
    far = model.excess > FAR
    motions = search.plant.data.motion
    cycles = [next(c for c in search.train if motions[c] == m) for m in sorted({int(motions[c]) for c in search.train})]
    none = dict.fromkeys(FAULTS, 0.0)
    alone = _starts_with(search, model, [s.candidate for s in screened], none)
    beside = {**model.fit.point, **none} if far else model.fit.point
    starts = [
        [s.start, other, *({**beside, **at} for at in (*s.candidate.shown_starts(), *s.candidate.sizes()))]
        for s, other in zip(screened, alone, strict=True)
    ]
    points = [point for of in starts for point in of]
    n_seeds, steps = (N_GLANCE_FAR, (DT_PROBE,)) if far else (N_GLANCE, None)
    here, *there = search.costs([model.fit.point, *points], cycles, typical=True, n_seeds=n_seeds, steps=steps)
    costs = iter(there)
    ranked = []
    for s, of in zip(screened, starts, strict=True):
        least, best = min((next(costs), at) for at in range(len(of)))
        ranked.append(Screened(model.fit.cost * least / here, s.candidate, of[best]))
    return sorted(ranked, key=_promised)


def columns_of(search: Search, c: Candidate) -> Array:
    """Whitened columns (per unit) of a probed candidate where nothing else acts."""
    names = [Free(c.probe_name(j), 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
    return stacked_jacobian(search.noise, names, search.columns, search.train)


def _does_as_well(simpler: Screened, s: Screened, hardly: float) -> bool:
    """Whether the same effect with fewer parameters promises hardly less."""
    fewer = len(simpler.candidate.linear) < len(s.candidate.linear)
    return simpler.candidate.effect == s.candidate.effect and fewer and simpler.promised < s.promised + hardly


def find_look_alikes(
    search: Search,
    model: Model,
    best: Model,
    screened: Sequence[Screened],
    fitted: set[Way],
    *,
    only_there: bool = False,
) -> list[Screened]:
    """Those that can do, beside what else is free, nearly all that the last effect of `best` does.

    What probes do where nothing else acts may mislead: what resembles the effect there begins where `best` is without
    it, with what by first order does the same there, and what this leaves is simulated. So is what was fitted already,
    if the effect has taken the place of faults: from these no fit gets there. With `only_there` all others are asked
    there: beside a drag that doubles the currents a constant load at the nominal point is no more like what it does
    there than anything else.
    """
    effect = best.effects[-1]
    done = _what_is_done(search, best, [effect])
    replaced = effect.faults if model.shows_faults_of(effect) else []
    new = [s for s in screened if s.candidate.effect != effect.effect]
    new = [s for s in new if replaced or s.candidate.way not in fitted]
    is_there = only_there and not replaced  # in the place of faults it is what it was taken for at the nominal point
    free = tuple(f for f in model.fit.free if f.name not in replaced)
    own = stacked_jacobian(search.noise, free, (best if is_there else model).fit.columns, search.train)
    probed = [s.candidate for s in new]
    if is_there:
        columns = _columns_at(search, strip(best, effect)[2], probed)
    else:
        columns = [columns_of(search, c) for c in probed]
    found: dict[Way, Screened] = {}
    asked: list[tuple[Screened, Array]] = []
    for s, J in zip(new, columns, strict=True):
        c = s.candidate
        if c.way in found:
            continue
        amounts, share = _do_most(done, J, own)
        if share > COLLINEAR and c.way not in fitted and not only_there:
            found[c.way] = s
        elif share > RESEMBLING:
            asked.append((s, amounts))
    begun = _start_instead(search, best, [effect], done, asked, replaced)
    for s in _keep_alike(search, best, done, begun, near=only_there and best.excess <= DISTANT):
        found.setdefault(s.candidate.way, s)
    return list(found.values())


def find_one_for_several(
    search: Search, best: Model, several: Sequence[Candidate], screened: Sequence[Screened]
) -> list[Screened]:
    """The nearest that can do what several effects of `best` do together, begun in their place."""
    done = _what_is_done(search, best, several)
    own = stacked_jacobian(search.noise, strip(best, *several)[1], best.fit.columns, search.train)
    amounts = ((s, *_do_most(done, columns_of(search, s.candidate), own)) for s in screened)
    asked = [(s, values) for s, values, share in amounts if share > RESEMBLING]
    begun = _start_instead(search, best, several, done, asked, ())
    return _keep_alike(search, best, done, begun, near=True)[:N_NEAREST]


def _what_is_done(search: Search, best: Model, effects: Sequence[Candidate]) -> Array:
    """What some effects of `best` do to the features of training cycles, to first order, whitened."""
    names = [f"{c.effect}.{name}" for c in effects for name in c.linear]
    frees = [f for f in best.fit.free if f.name in names]
    values = np.array([best.fit.point[f.name] - search.plant.neutral(f.name) for f in frees])
    return stacked_jacobian(search.noise, frees, best.fit.columns, search.train) @ values


def _start_instead(
    search: Search,
    best: Model,
    gone: Sequence[Candidate],
    done: Array,
    asked: Sequence[tuple[Screened, Array]],
    replaced: Sequence[str],
) -> list[Screened]:
    """Candidates that begin with what by first order does what some effects of `best` have done, in their place.

    Columns of each are taken over steps as long as the values, given with it, that do it by nominal probes.
    """
    others, rest = strip(best, *gone)[1:]
    others = tuple(f for f in others if f.name not in replaced)
    own, limits = stacked_jacobian(search.noise, others, best.fit.columns, search.train), bounds(others, rest)
    begun = []
    for s, values in asked:
        c = s.candidate
        low, high = (np.concatenate(ends) for ends in zip(limits, c.limits(), strict=True))
        (J,) = _columns_at(search, rest, [c.sized(values)])
        there = np.concatenate([own, J], axis=1)
        step, _ = solve_within_bounds(there, done, low, high)
        begun.append(s._replace(start={**step_to(rest, others, step[: len(others)]), **c.start(step[len(others) :])}))
    return begun


def _keep_alike(search: Search, best: Model, done: Array, begun: Sequence[Screened], near: bool) -> list[Screened]:
    """Those whose starts, simulated, leave hardly more than `best`, nearest first.

    Hardly more is what first order may be off by. What is found from noisy columns says little of what they leave: of
    runs that are random their difference does.
    """
    if not begun:
        return []
    points = [best.fit.point, *(s.start for s in begun)]
    left = residuals_at(search.plant, search.noise, points, search.train, N_GLANCE)
    here, *there = [search.noise.misfit(list(at.values()), search.train) for at in left]
    off = (CURVED**2 if near else 1.0 - COLLINEAR**2) * float(done @ done) / search.noise.expected(search.train)
    more = off + (within_reach(best) - best.fit.misfit if near else 0.0)
    nearest = sorted(zip(there, begun, strict=True), key=lambda entry: entry[0])
    return [s for misfit, s in nearest if misfit - here < more]


def _columns_at(search: Search, point: Point, found: Sequence[Candidate]) -> list[Array]:
    """Whitened columns (per unit) of candidates beside all that a point has."""
    if not found:
        return []
    first = search.plant.first
    points = [point, *({**point, **probe} for c in found for probe in c.probes())]
    here, *there = search.plant.means(points, first, N_PROBE, SEED, (DT_PROBE,))
    means, out = iter(there), []
    for c in found:
        names = [Free(c.probe_name(j), 0.0, 0.0, 1.0) for j in range(len(c.amounts))]
        probes = [next(means) for _ in names]
        cols = {
            (motion, f.name): (at[cycle] - here[cycle]) / amount
            for f, amount, at in zip(names, c.amounts, probes, strict=True)
            for motion, cycle in enumerate(first)
        }
        out.append(stacked_jacobian(search.noise, names, cols, search.train))
    return out


def _do_most(done: Array, columns: Array, own: Array) -> tuple[Array, float]:
    """With which values columns do most of something, and which share of what others beside them cannot do."""
    Q, _ = np.linalg.qr(own)
    done, columns = (x - Q @ (Q.T @ x) for x in (done, columns))
    values = np.asarray(np.linalg.lstsq(columns, done, rcond=None)[0], dtype=float)
    return values, float(np.linalg.norm(columns @ values)) / max(float(np.linalg.norm(done)), 1e-300)
