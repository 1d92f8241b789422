"""What a record is enough for: which plant, which findings, and what in it stands in the way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ema.core.errors import RecordError
from ema.core.names import CHANNELS, CURRENTS
from ema.core.records import Record
from ema.discrepancy.axis.reading import noise
from ema.discrepancy.axis.reading.channels import LOAD_CHANNEL, LOOP_CHANNELS, roles
from ema.discrepancy.axis.reading.intake import take_in
from ema.discrepancy.axis.reading.undersampled import refuse_undersampled
from ema.models.axis_config import Axis

from .agreements import Agreement
from .facts import FALLEN, ChannelFacts, Sampling

ACTUATOR = ("t", *CURRENTS, "theta_m", "theta_u", "theta_cmd")
DRIVES = (*noise.DRIVES, "w_ref")
FEW = 500  # samples of a record from which a fit has something left to be tested with
DUTY = 1.1  # largest duty cycle, with what a converter may add
JITTERY = 0.2  # of a period, rms


@dataclass(frozen=True)
class Allowed:
    """Plants that the record is enough for, each with what it can identify; and what stands in the way, in words.

    `refused` tells why a search would not take it as a record of the plant file that was given, if it would not.
    """

    plants: dict[str, str]
    missing: dict[str, list[str]]
    obstacles: list[str]
    refused: str = ""

    def only(self, kind: str) -> Allowed:
        """The same of one kind of plant."""
        plants = {own: what for own, what in self.plants.items() if own == kind}
        missing = {own: what for own, what in self.missing.items() if own == kind}
        return replace(self, plants=plants, missing=missing)


def list_allowed(
    record: Record, clock: Sampling, facts: list[ChannelFacts], agree: list[Agreement], plant: Axis | None = None
) -> Allowed:
    """What the record allows, as far as its channels show it; of an axis whose `plant` file is known, as one of it."""
    have = set(record.channels)
    plants: dict[str, str] = {}
    missing: dict[str, list[str]] = {}
    lacking = [_said(name) for name in ACTUATOR if name not in have]
    if lacking:
        missing["ema"] = lacking
    else:
        plants["ema"] = "faults k1…k6 and the effects of an actuator"
    motion = have & {"theta_m", "w_m", "q", "v"}
    drives = [name for name in DRIVES if name in have]
    loops = [reference for position, reference in LOOP_CHANNELS.values() if {position, reference} <= have]
    if motion and drives:
        load = LOAD_CHANNEL[not motion & {"theta_m", "w_m"}]
        against = f" against the known load {load}" if load in have else ""
        plants["axis"] = f"inertia, friction, loads and the effects of an axis, driven by {_one_of(drives)}{against}"
    elif loops:
        plants["axis"] = (
            "inertia, friction, loads and the effects of an axis, if the plant file declares the position_loop "
            f"by which {loops[0]} makes the drive"
        )
    else:
        references = " or ".join(reference for _, reference in LOOP_CHANNELS.values())
        a_drive = f"a drive: {', '.join(DRIVES)}, or {references} of a position_loop"
        missing["axis"] = [] if motion else ["a position or a speed: theta_m, w_m, q or v"]
        missing["axis"] += [] if drives else [a_drive]
    refused = ""
    if plant is not None:
        drive, refused = _take(plant, record)
        drives = [drive] if drive else drives
        if refused:
            plants.pop("axis", None)
        elif "axis" in plants:
            plants["axis"] = f"{plants['axis'].partition(', driven by')[0]}, driven by {drive}"
    disagreeing = [f"{one.what}: {one.said}" for one in agree if not one.is_fine]
    facts = [one for one in facts if not (record.is_at_rest and one.name in ("w_m", "v"))]
    by_time = [] if record.is_at_rest else _clock(clock)
    return Allowed(plants, missing, [*by_time, *_channels(facts, drives), *disagreeing], refused)


def _one_of(drives: list[str]) -> str:
    """What may drive: `ema plant init` takes the first, and a plant file says which."""
    more = f", or by {' or '.join(drives[1:])} where the plant file's drive says so" if len(drives) > 1 else ""
    return f"{drives[0]}{more}"


def _take(plant: Axis, record: Record) -> tuple[str, str]:
    """The channel that drives, and why a search refuses the record; one of them is empty."""
    try:
        (taken,) = take_in(plant, [record])
        refuse_undersampled(plant, taken)
        drive = roles(plant, taken).drive
    except RecordError as error:
        return "", str(error).removeprefix(f"{record.name}: ")
    return ("duty" if drive == "u_q" and drive not in record.channels else drive), ""


def say_repeated(n: int) -> str:
    """What is said of rows that repeat the one before."""
    return f"{n} rows repeat the one before in every measured channel: samples were lost, and the last was taken again"


def _said(name: str) -> str:
    return f"{name} [{CHANNELS[name].unit}]"


def _clock(clock: Sampling) -> list[str]:
    said = []
    if clock.n_gaps:
        said.append(f"{clock.n_gaps} gaps, the longest {clock.longest:.3g} s at a period of {clock.period:.3g} s")
    if clock.n_repeated:
        said.append(say_repeated(clock.n_repeated))
    if clock.jitter > JITTERY:
        said.append(f"time steps vary by {100 * clock.jitter:.0f} % of the period; they are taken as they are stamped")
    if clock.n_samples < FEW:
        said.append(f"{clock.n_samples} samples: too few to test a fit on a part that it has not seen")
    return said


def _channels(facts: list[ChannelFacts], drives: list[str]) -> list[str]:
    """Of each channel; where several may drive, what is sampled too slowly is in the way of the first of them."""
    said = []
    for one in facts:
        if one.is_constant:
            said.append(f"{one.name} is constant at {one.low:g} {one.unit}: it says nothing")
        elif one.held > 0.0:
            share = f"{100 * one.held:.1f} % of the samples"
            said.append(f"{one.name} is held at an end of its range for {share}: clipped, or a limit")
        if one.name == "duty" and max(one.high, -one.low) > DUTY:
            said.append(f"duty goes to {max(one.high, -one.low):g} where 1 is the whole supply: in per cent? unit: '%'")
        if one.name in drives[:1] and one.upper > FALLEN:
            said.append(
                f"{one.name} does not fall off before half the sampling rate ({100 * one.upper:.0f} % of its power "
                "is in the upper part): sampled too slowly for what it does; record faster, or move more slowly"
            )
        if one.step and one.step > 0.02 * (one.high - one.low):
            n = int(np.ceil((one.high - one.low) / one.step))
            said.append(f"{one.name} has only {n} steps over its range: its noise is its quantisation")
    return said
