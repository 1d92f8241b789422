"""Ways through the search: from which noise, with which faults, to what end."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ema.core.names import FAULTS
from ema.core.records import Array
from ema.discrepancy.actuator.fitting.comparators import PLAIN
from ema.discrepancy.actuator.fitting.conditions import Conditions
from ema.discrepancy.actuator.fitting.growing import is_steady
from ema.discrepancy.actuator.fitting.model import CHANCE, DISTANT, Model
from ema.discrepancy.actuator.fitting.search import Search, start_model
from ema.discrepancy.actuator.fitting.timing import find_samples_late
from ema.discrepancy.actuator.simulating.noise import Noise, Verdict
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.plant import Point

from .forward import CLOSE, NEARLY_ALL, add_effects, exchange_earlier_effects, try_other_first_effects
from .simpler import simplify
from .verdicts import FAULT_ALARM, NEARLY, judge_closely, take_bench_conditions


@dataclass(frozen=True)
class Path:
    """One way through the search: with what noise and under which conditions of the record, from where to where.

    `alike` holds, for each effect of `after`, what does as well in its place, `as_well` the effects that would explain
    as well what several of its faults have in common.
    """

    noise: Noise
    conditions: Conditions
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
        conditions = Conditions.of(search.plant)
        return cls(search.noise, conditions, list(search.tried), model, v, model, v, [], [])


def begin_with_faults(search: Search, of_each: Array, point: Point) -> Search:
    """A search from the beginning with faults of each cycle, shape (n_cycles, 6), and noise as at their mean."""
    mean = of_each.mean(axis=0)
    old = search.plant
    plant = EmaPlant(old.plant, replace(old.data, faults=of_each - mean), old.n_threads, old.resonance)
    plant.work, plant.leaves_zero_open = old.work, old.leaves_zero_open
    Conditions.of(old).take(plant)
    noise = Noise(plant, {**point, **dict(zip(FAULTS, mean.tolist(), strict=True))})
    return Search(plant, noise, search.train, search.heldout, search.say)


def go_on(search: Search, path: Path) -> Path:
    """A path to its end from the effects that were found, after the cycles' faults were found anew beside them.

    Odds stay those of what was tried beside the same faults.
    """
    before = start_model(search, {name: search.noise.point[name] for name in FAULTS})
    after = search.model(path.after.effects, path.after.fit.free, search.noise.point, None, 4)
    v, known = search.verdict(after), Path.of(search, before)
    begun = replace(known, tried=path.tried, after=after, verdict=v, alike=path.alike, as_well=path.as_well)
    return _go(search, begun)


def retry_with_steady_faults(search: Search, path: Path) -> Path | None:
    """A path found beside faults of each cycle, gone to its end beside steady ones if with its effects these will do.

    What is missing in a simulation may make cycles of one motion differ by more than its noise.
    """
    search.noise = Noise(search.plant, path.after.fit.point)
    model = search.model(path.after.effects, path.after.fit.free, path.after.fit.point, None, 4)
    search.noise = Noise(search.plant, model.fit.point)
    if not is_steady(search, model):
        return None
    search.say("beside what was found, cycles of one motion differ by chance alone")
    return go_on(search, replace(path, after=model))


def begin_with_faults_alone(search: Search, faults: Point) -> list[Path]:
    """Paths that begin with faults alone, from where these are expected.

    What faults make of the noise weighs what tells them; both are found in turn.

    Where that leads nowhere near the data, the faults found stand for something else. Then the noise may be what it is
    without faults, or what they make of it: friction or drag, whatever their cause, change it hundredfold.
    """
    model = start_model(search, faults)
    late = find_samples_late(search.plant, search.noise, model.fit.point, search.train) if model.excess > NEARLY else 0
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


def choose_path(search: Search, paths: list[Path]) -> Path:
    """The first path that leaves next to nothing, or else the one that leaves least by the noise of both."""
    best = _go(search, paths[0])
    for path in paths[1:]:
        if best.verdict.is_noise or best.after.excess < max(CHANCE, min(NEARLY, NEARLY_ALL * best.before.excess)):
            break
        search.say("again, with the noise that faults alone make")
        other = _go(search, path)
        if search.left_more(other.after, best.after, (other.noise, best.noise)) < 0.0:
            best = other
    return best


def resume(search: Search, path: Path) -> None:
    """Noise, tried models and conditions of the record as they are on a path."""
    search.noise, search.tried = path.noise, list(path.tried)
    path.conditions.take(search.plant)


def put_one_in_place_of_faults(
    search: Search, before: Model, v: Verdict, alike: list[tuple[str, ...]]
) -> tuple[Model, Verdict]:
    """`before`, or one effect for what several of its faults have in common, if that leaves noise by its own.

    Beside these faults a fit goes astray near the data: by the noise that they make, it sees little of the direction
    between them and the effect.
    """
    if v.is_noise:
        return before, v
    noise, sets = search.noise, list(alike)
    made, w = simplify(search, before, before, v, sets, [])
    if w.is_noise:
        alike[:] = sets
        return made, w
    search.noise = noise
    return before, v


def _go(search: Search, begun: Path) -> Path:
    """A path to its end: what explains the cycles."""
    resume(search, begun)
    before, verdict_before = judge_closely(search, begun.before, begun.verdict_before)
    if not verdict_before.is_noise and not begun.after.effects:
        before, verdict_before = take_bench_conditions(search, before, verdict_before, PLAIN)
    search.say(f"faults only: p = {verdict_before.p_value:.2g}, most visible: {verdict_before.loudest}")
    alike, as_well = list(begun.alike), list(begun.as_well)
    after, v = begun.after, begun.verdict
    if not begun.after.effects:
        after, v = put_one_in_place_of_faults(search, before, verdict_before, alike)
    after, v = add_effects(search, before, after, v, alike)
    if not v.is_noise:
        after, v = exchange_earlier_effects(search, after, v, alike)
    if not v.is_noise:  # the library had its chance
        other, w = take_bench_conditions(search, after, v)
        if other is not after:
            if after is before:
                before, verdict_before = other, w
            after, v = add_effects(search, before, other, w, alike)
    after, v = try_other_first_effects(search, before, after, v, alike)
    if verdict_before.is_noise:
        after, v = simplify(search, before, after, v, alike, as_well)
    conditions = Conditions.of(search.plant)
    return Path(search.noise, conditions, search.tried, before, verdict_before, after, v, alike, as_well)
