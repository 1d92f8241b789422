"""The whole examination of an actuator's cycles: verdict, effects, structure, gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ema.core.errors import RecordError
from ema.core.records import Array, Record
from ema.discrepancy.engine.contest import Outcome
from ema.discrepancy.findings import Findings
from ema.discrepancy.grade import IN_SET, NAMED
from ema.discrepancy.progress import Progress
from ema.discrepancy.report import Picture
from ema.effects import registry
from ema.identification.alignment import aligned
from ema.models import actuator_file
from ema.models.actuator import Actuator

from .clipping import describe as describe_ranges
from .conditions import take_recorded_conditions
from .cycles import prepare
from .entrants import weigh_sets
from .faint import fit_faint_effects, hear, may_hide_something
from .forward import add_effects
from .gear import find_resonance, start_swinging
from .growing import describe, deviations, find_faults_beside, find_growing_faults
from .measured import Measured
from .model import Model
from .next_recording import next_recording
from .noise import Noise, Verdict
from .paths import Path as Way
from .paths import begin_with_faults, begin_with_faults_alone, choose_path, go_on, resume, retry_with_steady_faults
from .plant import EmaPlant
from .play import add_user_friction, take_hold_of_user
from .search import Search
from .simpler import (
    drop_constant_parts,
    drop_faults,
    keep_alike,
    simplify,
    take_resolver_zero,
)
from .telling import probabilities, try_as_function, write_findings
from .thinning import thin
from .verdicts import NEARLY, settle_at_minimum
from .weighing import is_credible

MIN_CYCLES = 2
Alike = list[tuple[str, ...]]  # for each effect of a model, what does as well in its place
N_BESIDE = 2  # turns in which faults of each cycle are found anew beside the effects


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


def shows_held_out_only(search: Search, before: Model) -> bool:
    """Whether faults alone explain the training cycles and not the held-out ones, which have motions of their own.

    No effect gains by a fit to motions that do not show it.
    """
    motion = search.plant.data.motion
    is_apart = set(motion[search.heldout]).isdisjoint(motion[search.train])
    return is_apart and before.fit.misfit - 1.0 < NEARLY < before.excess


def is_named(outcome: Outcome, model: Model, effect: str, *rivals: str) -> bool:
    """Whether an effect of `model` is told as a cause: one of its set is likely, and that is not faults alone.

    Faults are in every model: where they do as well in its place and are far likelier, nothing is missing. A rival that
    was found beside it since is none: the set with that in its place is the one without the effect.
    """
    rivals = tuple(name for name in rivals if name not in model.names)
    p = dict(zip((effect, *rivals), probabilities(outcome, model, effect, *rivals), strict=True))
    of_effects = sum(x for name, x in p.items() if name in registry())
    return sum(p.values()) >= NAMED and of_effects >= IN_SET * sum(p.values())


def led_by(names: Sequence[str], found: Sequence[str], alike: Alike) -> Alike | None:
    """What may be in the place of each of `names`, where these are `found` but for what may be in their place; or None.

    `alike` holds, for each effect that was found, what may be in its place.
    """
    of: dict[str, tuple[str, ...]] = {}
    for same in ((effect, *rivals) for effect, rivals in zip(found, alike, strict=True)):
        own = next((name for name in same if name in names and name not in of), None)
        if own is not None:
            of[own] = tuple(name for name in same if name != own)
    return [of[name] for name in names] if len(names) == len(found) and of.keys() == set(names) else None


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
class _Answer:
    """A model with its verdict and, for each of its effects, what does as well in its place."""

    model: Model
    verdict: Verdict
    alike: Alike


def examine(plant: Actuator, data: Measured, *, n_threads: int = 2, say: Progress | None = None) -> Examination:
    """What the simulation of `plant` gets wrong about `data`."""
    if data.n_cycles < MIN_CYCLES:
        raise RecordError(
            f"{data.labels[0]}: is the only cycle; at least {MIN_CYCLES} are needed, to test on one what another says"
        )
    say = say or Progress()
    data, left_out = thin(data)
    as_stated = plant
    train, heldout = split(data)
    plant, conditions = take_recorded_conditions(plant, data.signals)
    gear = find_resonance(plant, data)
    plant, data = take_hold_of_user(plant, start_swinging(data, gear))
    ema = EmaPlant(plant, data, n_threads, gear)
    say("switching noise")
    search, path, of_each = _find_path(Search(ema, Noise(ema, {}), train, heldout, say))
    outcome, answer, notes = _take_likeliest(search, path, _prefer_fewer_causes(search, path))
    findings, after = _write(search, path, answer, outcome, of_each)
    findings.notes.extend([*conditions, *([left_out] if left_out else []), *notes])
    if findings.verdict == "adequate":
        findings.notes.extend(path.as_well)
    if of_each is not None:
        findings.notes.append(describe(search.plant.data.faults, after.fit.point))
    findings.notes.extend(_describe_conditions(search.plant))
    findings = add_user_friction(as_stated, plant, findings)
    return Examination(findings, search, path.before, after, path.verdict_before, answer.verdict)


def _find_path(search: Search) -> tuple[Search, Way, Array | None]:
    """The search and its way to what explains the cycles, and faults of each cycle (n_cycles, 6) where these grow.

    Faults of each cycle and what all cycles leave alike are found in turn.
    """
    paths = begin_with_faults_alone(search, {})
    if shows_held_out_only(search, paths[0].before):
        search.say("only held-out motions show that something is missing: these are fitted, and the others held out")
        search = Search(search.plant, Noise(search.plant, {}), search.heldout, search.train, search.say)
        paths = begin_with_faults_alone(search, {})
    of_each = None if paths[0].verdict.is_noise else find_growing_faults(search, paths[0].before)
    steady = search
    if of_each is not None:
        search = begin_with_faults(search, of_each, {})
        paths = begin_with_faults_alone(search, search.noise.point)
    path = choose_path(search, paths)
    if of_each is not None and path.after.effects and (other := retry_with_steady_faults(steady, path)) is not None:
        of_each, search, path = None, steady, other
    for turn in range(N_BESIDE):
        if of_each is None or not path.after.effects:
            break
        resume(search, path)
        after, v = drop_constant_parts(search, path.after, path.verdict)
        if turn and path.verdict.is_noise and after is path.after:
            break
        of_each, point = find_faults_beside(search, after)
        search = begin_with_faults(search, of_each, point)
        path = go_on(search, replace(path, after=after, verdict=v))
    resume(search, path)
    return search, path, of_each


def _prefer_fewer_causes(search: Search, path: Way) -> _Answer:
    """What a path found at its minimum, with as few faults and effects as do as well."""
    before, alike = path.before, path.alike
    after, v = settled, _ = settle_at_minimum(search, path.after, path.verdict, alike)
    if not path.verdict_before.is_noise:
        after, v = drop_faults(search, before, after, v, alike)
        after, v = simplify(search, before, after, v, alike, path.as_well)
    if after is not settled:
        after, v = settle_at_minimum(search, after, v, alike)
    after, v = drop_constant_parts(search, after, v)
    after, v = take_resolver_zero(search, after, v, alike)
    return _Answer(after, v, alike)


def _take_likeliest(search: Search, path: Way, found: _Answer) -> tuple[Outcome, _Answer, list[str]]:
    """All sets weighed; the likeliest where what was found has an effect less likely than not; and notes.

    Where faults alone leave about noise, what the score hears all the same is taken for found. Of effects that may
    stand in each other's place the likeliest comes first.
    """
    faint = fit_faint_effects(search, found.model) if may_hide_something(found.model, found.verdict) else []
    outcome, models = weigh_sets(search, path.before, found.model, faint)
    if may_hide_something(found.model, found.verdict) and (heard := hear(outcome, models)) is not None:
        found = _go_on_from_heard(search, path, *heard)
        others = [m for m in faint if m.names != found.model.names]
        outcome, models = weigh_sets(search, path.before, found.model, others)
    sets = [(name, *rivals) for name, rivals in zip(found.model.names, found.alike, strict=True)]
    unlikely = [names[0] for names in sets if not is_named(outcome, found.model, *names)]
    notes = []
    if unlikely and (not models[0].effects or is_credible(models[0])):
        best = models[0]
        search.say(f"{' + '.join(best.names) or 'faults only'} instead of {' + '.join(found.model.names)}")
        of = dict(zip(found.model.names, found.alike, strict=True))
        v = search.verdict(best) if best.effects else path.verdict_before
        found = _Answer(best, v, [of.get(name, ()) for name in best.names])
    elif unlikely:
        notes = [f"{', '.join(unlikely)} would do, but what can be no cause would do much better: not named"]
        found = _Answer(path.before, path.verdict_before, [])
    elif models[0].names != found.model.names and (led := led_by(models[0].names, found.model.names, found.alike)):
        search.say(f"{' + '.join(models[0].names)} first: what may be in its place is less likely")
        found = _Answer(models[0], search.verdict(models[0]), led)
    alike = [keep_alike(search, found.model, j, rivals) for j, rivals in enumerate(found.alike)]
    return outcome, replace(found, alike=alike), notes


def _go_on_from_heard(search: Search, path: Way, model: Model, rivals: tuple[str, ...]) -> _Answer:
    """What the score has heard, at its minimum, and what there is to be found beside it."""
    search.say(f"{model.names[0]}: faults alone leave about noise, and the score is sure of more")
    alike = [rivals]
    model, v = settle_at_minimum(search, model, search.verdict(model), alike)
    if not v.is_noise:
        model, v = add_effects(search, path.before, model, v, alike)
    return _Answer(model, v, alike)


def _write(
    search: Search, path: Way, answer: _Answer, outcome: Outcome, of_each: Array | None
) -> tuple[Findings, Model]:
    """Findings, and the model they are of."""
    before, after, alike = path.before, answer.model, answer.alike
    least_sd = deviations(search, after) if of_each is not None and after.effects else {}
    findings = write_findings(search, before, after, answer.verdict, alike, outcome, least_sd)
    findings = replace(findings, next_recording=next_recording(search, after, alike, findings.posterior))
    if findings.verdict == "unexplained" and not findings.effects and not findings.unnamed:
        findings, after = try_as_function(search, findings, before, after)
    return findings, after


def _describe_conditions(ema: EmaPlant) -> list[str]:
    """What was read from the record and is no flaw of the actuator, in words."""
    notes = describe_ranges(ema.data.ranges)
    if ema.late:
        side, samples = "late" if ema.late > 0 else "early", "sample" if abs(ema.late) == 1 else "samples"
        notes.append(f"the recorded command is {abs(ema.late)} {samples} {side} against the other channels")
    if ema.data.zero:
        notes.append(f"θ_m/GR and θ_u are {ema.data.zero:.2g} rad apart in the middle of the play")
    if ema.step:
        notes.append(f"the comparators of the record switch as if evaluated every {1e6 * ema.step:g} µs")
    return notes


def discrepancy(
    plant_file: Path, records: Sequence[Record], say: Progress
) -> tuple[Findings, Callable[[], list[Picture]]]:
    """Findings on records of the actuator in `plant_file`, and what draws their pictures."""
    from .pictures import pictures

    plant = actuator_file.load(plant_file)
    read = [aligned(record, plant) for record in records]
    notes = [note for _, own in read for note in own]
    for note in notes:
        say(note)
    examination = examine(plant, prepare(plant, [record for record, _ in read]), say=say)
    findings = examination.findings
    return replace(findings, notes=[*notes, *findings.notes]), lambda: pictures(examination)
