"""Why not this cause? Answered from findings.json, by the numbers that the answer rests on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ema.core.errors import ConfigError
from ema.effects import registry


def read_findings(folder: Path) -> dict[str, Any]:
    """The findings.json of an earlier run; ConfigError where there is none that can be read."""
    path = folder / "findings.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ConfigError(f"{path}: is not there; run ema discrepancy with records first") from error
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read as findings: {error}") from error
    if not isinstance(found, dict) or "effects" not in found:
        raise ConfigError(f"{path}: holds no findings (no key 'effects')")
    return found


def explain_cause(findings: Mapping[str, Any], cause: str) -> str:
    """One sentence on a cause: named, one of a set, rejected with what it leaves, or not fitted at all.

    ConfigError where no effect of that name exists.
    """
    if cause not in registry():
        raise ConfigError(f"--explain {cause}: no such effect; there are {', '.join(registry())}")
    for effect in findings["effects"]:
        if effect["name"] == cause:
            return f"{cause} is the answer, with a confidence of {effect['confidence']:.0%}: {effect['sentence']}."
        if cause in effect["indistinguishable_from"]:
            return (
                f"{cause} is not ruled out: these records cannot tell it from {effect['name']}; "
                f"told apart by {effect['separated_by']}."
            )
    moved = findings.get("moved", {})
    if cause in moved.get("alike", ()):
        return (
            f"{cause} is not ruled out: on these records it would look the same as what was fitted in its place "
            f"({moved['said']}); told apart by {registry()[cause].separated_by}."
        )
    tried = [row for row in findings.get("rejected", []) if cause in str(row["name"]).split(" + ")]
    if tried:
        best = tried[0]
        beside = "" if best["name"] == cause else f" (best as {best['name']})"
        return f"{cause} was fitted{beside} and is not the answer: {best['why']}."
    if findings["verdict"] == "adequate":
        return f"{cause} was not fitted: what is left without any effect is noise, or too little to be told from it."
    return (
        f"{cause} was not fitted: to first order it promised less than what was, or these records cannot show it. "
        f"What shows it is {registry()[cause].separated_by}."
    )
