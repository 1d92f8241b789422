"""Trials of the axis plant of one commit: as `benchmarks.frozen`, with the strata of `strata_axis`.

python -m benchmarks.frozen_axis --trials 200 --out var/frozen_axis.jsonl
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks import frozen, strata_axis
from ema.core.errors import RecordError
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import LinearAxis, RotaryAxis


@frozen.command
def main(trials: int, threads: int, out: Path | None, rows_files: tuple[Path, ...], into: Path | None) -> None:
    """Run the trials of this commit that are missing, and print the table."""
    if rows_files:
        click.echo(frozen.render(rows_files, into))
        return
    out = out or Path("var/frozen_axis.jsonl")
    frozen.run(out, strata_axis.counts(trials), lambda *of: trial(strata_axis.drawn(*of), threads))


def trial(t: strata_axis.Trial, threads: int) -> dict[str, Any]:
    """Look for what a trial hides, and lay what is found beside it."""
    told = t.told
    model = LinearAxis if t.plant_file.get("motion") == "linear" else RotaryAxis
    begun = time.process_time()
    try:
        plant = AxisPlant(model.model_validate(t.plant_file), t.records, n_threads=threads)
        found = findings(plant, examine_ways(plant))
    except RecordError as error:
        return {**told, "outcome": "refused", "said": [str(error)]}
    except Exception as error:  # a defect: it counts against the finder, and the run goes on
        failed = {"outcome": "crashed", "verdict": "crashed", "named": [], "confidence": [], "z": {}}
        return {**told, **failed, "cpu_s": time.process_time() - begun, "said": [f"{type(error).__name__}: {error}"]}
    return {**told, **beside_truth(t, found.as_dict()), "cpu_s": time.process_time() - begun}


def beside_truth(t: strata_axis.Trial, said: dict[str, Any]) -> dict[str, Any]:
    """What is in findings.json, laid beside what was hidden."""
    effects = said["effects"]
    # of two lines of cogging the first, larger one is the one whose amplitude is told in the truth
    quantities = {f"{e['name']}.{name}": q for e in reversed(effects) for name, q in e["parameters"].items()}
    true = {name: x for name, x in t.truth.items() if name in quantities and name in strata_axis.EXACT}
    z = {name: _deviations(quantities[name], x) for name, x in true.items()}
    result = outcome(t, said)
    hit = {name for e in effects for name in (e["name"], *e["indistinguishable_from"])}
    missed = [strata_axis.nats(t, name) for name in t.effects if name not in hit] if result == "missed" else []
    return {
        "outcome": result, "verdict": said["verdict"], "nats": max(missed, default=None),
        "named": [[e["name"], *e["indistinguishable_from"]] for e in effects],
        "confidence": [e["confidence"] for e in effects],
        "posterior": said.get("posterior", [])[:5],
        "of_set": [e.get("of_set") for e in effects],
        "z": {name: x for name, x in z.items() if np.isfinite(x)},
        **said["gain"]["heldout"], "said": said["structure"].get("sentences", []),
    }  # fmt: skip


def _deviations(told: dict[str, float], x: float) -> float:
    """How far a told value is from the true one, where the interval's end on that side is 1.96 away."""
    value, side = told["value"], told["high"] - told["value"] if x > told["value"] else told["value"] - told["low"]
    return 1.96 * (value - x) / side if side > 0.0 else np.nan


def outcome(t: strata_axis.Trial, findings: dict[str, Any]) -> str:
    """How the finder did: right, in set, wrong, missed."""
    sets = [{e["name"], *e["indistinguishable_from"]} for e in findings["effects"]]
    sets = [s | {strata_axis.ALSO[name] for name in s & set(t.near) & set(strata_axis.ALSO)} for s in sets]
    named, wanted = len(sets), set(t.effects)
    sets = [s for s in sets if not s & set(t.there)]
    if not wanted and t.kind in strata_axis.OUTSIDE:
        is_near = bool(sets) and all(s & set(t.near) for s in sets)
        said = "right" if is_near or (findings["verdict"] == "unexplained" and not sets) else "wrong"
        return "missed" if findings["verdict"] == "adequate" else said
    if not wanted:
        return "right" if findings["verdict"] == "adequate" or (named and not sets) else "wrong"
    if not sets:
        return "missed"
    if not all(s & wanted for s in sets):
        return "wrong"
    if not all(any(name in s for s in sets) for name in wanted):
        return "missed"
    return "right" if all(len(s - set(t.near)) == 1 for s in sets) else "in set"


if __name__ == "__main__":
    main()
