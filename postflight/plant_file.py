"""The text of a first plant file."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ema.core import resources
from ema.core.records import Record
from ema.discrepancy.axis.reading import stamps
from ema.discrepancy.records import begin


def axis_file(records: Sequence[Record], sheet: begin.Sheet, name: str) -> str:
    """Of an axis; RecordError where the records hold no motion or no drive."""
    known = begin.begin_axis(records, sheet)
    lines = [*_head(records), *_stamps(records), f"name: {name}"]
    for one in known:
        line = f"{one.key}: {one.value}"
        lines.append(f"{line:<32} # {one.origin}" if one.origin else line)
    return "\n".join([*lines, "effects: {}", ""])


def actuator_file(records: Sequence[Record], sheet: begin.Sheet, name: str) -> str:
    """Of a three-phase actuator: the shipped one, with what is known of this one put in."""
    text = resources.config("actuator.yaml").read_text(encoding="utf-8")
    p = sheet.pole_pairs or begin.pole_pairs(records[0])
    GR = sheet.gear or begin.gear_ratio(records[0])
    k_e = None if sheet.KV is None else begin.back_emf(sheet.KV)
    changes = {
        "name": (name, "given"),
        "p": (p, "data sheet" if sheet.pole_pairs else "as the currents turn with the rotor"),
        "GR": (None if GR is None else f"{GR:.5g}", "data sheet" if sheet.gear else "slope of theta_m over theta_u"),
        "R": (sheet.R and f"{sheet.R:g} ohm", "data sheet"),
        "L": (sheet.L and f"{sheet.L:g} H", "data sheet"),
        "k_e": (k_e and f"{k_e:.4g} V s/rad", "KV"),
        "J_m": (sheet.J and f"{sheet.J:g} kg m^2", "data sheet"),
    }
    for key, (value, origin) in changes.items():
        if value is not None:
            text = re.sub(
                rf"^(\s*){key}:[^#\n]*(#.*)?$", rf"\g<1>{key}: {value}  # {origin}", text, count=1, flags=re.M
            )
    guess = (
        "# What carries no other remark is the shipped actuator's: a guess for yours, to be replaced by its data sheet."
    )
    return "\n".join([*_head(records), guess, "", *text.splitlines()[1:], ""])


def _stamps(records: Sequence[Record]) -> list[str]:
    """What is the matter with the times of the samples, which makes inertia and friction another."""
    said = []
    for record in records:
        motion = next(name for name in begin.motion_channels(record.channels) if name in record.channels)
        said += stamps.describe(record.name, record.cycles, motion)
    return [f"# {text}; what is fitted below may be off" for text in said]


def _head(records: Sequence[Record]) -> list[str]:
    files = ", ".join(record.name for record in records)
    return [f"# Begun by 'ema plant init' from {files}", f"# with the channels {begin.describe_channels(records)}."]
