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
from ema.discrepancy.plant import Point
from ema.discrepancy.progress import Progress
from ema.discrepancy.report import Picture
from ema.identification.alignment import aligned
from ema.models import actuator_file
from ema.models.actuator import Actuator

from .finding.paths import Path as Way
from .finding.paths import (
    begin_with_faults,
    begin_with_faults_alone,
    choose_path,
    go_on,
    resume,
    retry_with_steady_faults,
)
from .finding.simpler import drop_constant_parts, drop_faults, simplify, take_resolver_zero
from .finding.verdicts import NEARLY, settle_at_minimum
from .fitting.comparators import is_finest
from .fitting.growing import describe, deviations, find_faults_beside, find_growing_faults
from .fitting.model import Model
from .fitting.search import Search
from .reading.clipping import describe as describe_ranges
from .reading.conditions import take_recorded_conditions
from .reading.cycles import prepare
from .reading.gear import find_resonance, start_swinging
from .reading.measured import Measured
from .reading.play import add_user_friction, take_hold_of_user
from .reading.thinning import thin
from .scoring.likeliest import Answer, take_likeliest
from .simulating.noise import Noise, Verdict
from .simulating.plant import EmaPlant
from .telling.next_recording import next_recording
from .telling.telling import try_as_function, write_findings

MIN_CYCLES = 2
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


@dataclass(frozen=True)
class Examination:
    """The answer with what the report draws."""

    findings: Findings
    search: Search
    before: Model
    after: Model
    verdict_before: Verdict
    verdict_after: Verdict


def examine(plant: Actuator, data: Measured, *, n_threads: int = 2, say: Progress | None = None) -> Examination:
    """What the simulation of `plant` gets wrong about `data`."""
    if data.n_cycles < MIN_CYCLES:
        raise RecordError(
            f"{data.labels[0]}: is the only cycle; at least {MIN_CYCLES} are needed, to test on one what another says"
        )
    search, conditions = begin(plant, data, n_threads, say or Progress(), {})
    taken = search.plant.plant
    search, path, of_each = _find_path(search)
    outcome, answer, notes = take_likeliest(search, path, _prefer_fewer_causes(search, path))
    findings, after = _write(search, path, answer, outcome, of_each)
    findings.notes.extend([*conditions, *notes])
    if findings.verdict == "adequate":
        findings.notes.extend(path.as_well)
    if of_each is not None:
        findings.notes.append(describe(search.plant.data.faults, after.fit.point))
    findings.notes.extend(_describe_conditions(search.plant))
    findings = add_user_friction(plant, taken, findings)
    return Examination(findings, search, path.before, after, path.verdict_before, answer.verdict)


def begin(plant: Actuator, data: Measured, n_threads: int, say: Progress, point: Point) -> tuple[Search, list[str]]:
    """The search for what a record hides, under the conditions of the record, and what is to be told of these.

    Its noise is that near `point`.
    """
    data, left_out = thin(data)
    train, heldout = split(data)
    plant, conditions = take_recorded_conditions(plant, data.signals)
    gear = find_resonance(plant, data)
    plant, data = take_hold_of_user(plant, start_swinging(data, gear))
    ema = EmaPlant(plant, data, n_threads, gear)
    say("switching noise")
    return Search(ema, Noise(ema, point), train, heldout, say), [*conditions, *([left_out] if left_out else [])]


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


def _prefer_fewer_causes(search: Search, path: Way) -> Answer:
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
    return Answer(after, v, alike)


def _write(
    search: Search, path: Way, answer: Answer, outcome: Outcome, of_each: Array | None
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
        finest = ", the finest that was tried: or at no clock" if is_finest(ema, ema.step) else ""
        notes.append(f"the comparators of the record switch as if evaluated every {1e6 * ema.step:g} µs{finest}")
    return notes


def discrepancy(
    plant_file: Path, records: Sequence[Record], say: Progress
) -> tuple[Findings, Callable[[], list[Picture]]]:
    """Findings on records of the actuator in `plant_file`, and what draws their pictures."""
    from .telling.pictures import pictures

    plant = actuator_file.load(plant_file)
    read = [aligned(record, plant) for record in records]
    notes = [note for _, own in read for note in own]
    for note in notes:
        say(note)
    examination = examine(plant, prepare(plant, [record for record, _ in read]), say=say)
    findings = examination.findings
    return replace(findings, notes=[*notes, *findings.notes]), lambda: pictures(examination)
