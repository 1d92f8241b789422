"""The plant file with what was found in it; every command takes it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from ema.core import config
from ema.models.axis_config import LINES

from .findings import FoundEffect


def write_extended(
    plant_file: Path, effects: Iterable[FoundEffect], out: Path, fitted: Mapping[str, Any] | None = None
) -> None:
    """Write `plant_file` with the effects' values and intervals of 95 %; what an engineer would say stands at the top.

    An axis may have lines of torque more than once: the next gets a number, ``cogging#2``. On an actuator the values
    found replace those of the file. `fitted` replaces further keys.
    """
    data: dict[str, Any] = config.read_yaml(plant_file)
    declared: dict[str, dict[str, float]] = dict(data.get("effects") or {})
    intervals: dict[str, dict[str, list[float]]] = dict(data.get("intervals") or {})
    comments = [f"# {plant_file.name} with what `ema discrepancy` found in measured records."]
    written: set[str] = set()
    several = data.get("kind") == "axis"
    for effect in effects:
        if not effect.in_every_record:
            comments.append(f"# not in this model, since not in every record: {effect.sentence}")
            continue
        key, number = effect.name, 1
        while several and (key in written or (effect.name in LINES and key in declared)):
            number += 1
            key = f"{effect.name}#{number}"
        written.add(key)
        declared[key] = {
            **declared.get(key, {}),
            **{name: float(f"{q.value:.6g}") for name, q in effect.parameters.items()},
        }
        known = {
            name: [float(f"{x:.6g}") for x in (q.low, q.high)]
            for name, q in effect.parameters.items()
            if q.low < q.high
        }
        if known:
            intervals[key] = {**intervals.get(key, {}), **known}
        comments.append(f"# {effect.sentence}")
        if effect.indistinguishable_from:
            comments.append(f"#   or {', '.join(effect.indistinguishable_from)}; told apart by {effect.separated_by}")
    data["effects"] = declared
    if intervals:
        data["intervals"] = intervals
    data |= fitted or {}
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    out.write_text("\n".join(comments) + "\n" + text, encoding="utf-8")
