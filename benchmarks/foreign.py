"""Records of a simulator of another hand (`tests/data/foreign_actuator`), examined: what comes back.

    python -m benchmarks.foreign recorder_gain late_position --out var/foreign.jsonl
    python -m benchmarks.foreign flux_and_faults --finder engine

`--finder engine` looks with `ema.discrepancy.engine` instead of the search that `ema discrepancy` runs.

Every record is a line of the results file, with the truth beside the answer; a line is added, none is replaced.
"""

from __future__ import annotations

import json
import lzma
import tempfile
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.frozen import commit
from benchmarks.kernel import costs
from ema.core import config, resources
from ema.core.names import FAULTS
from ema.core.records import Record, read_record
from ema.discrepancy.actuator.conditions import as_recorded
from ema.discrepancy.actuator.cycles import measured
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.plant import EmaPlant
from ema.discrepancy.actuator.problem import ActuatorProblem
from ema.discrepancy.engine.search import Search
from ema.discrepancy.engine.weighing import Budget
from ema.discrepancy.progress import Progress
from ema.models.actuator import Actuator

BUDGET = Budget(records=16, column_seeds=4, fit_seeds=8, width=3, rounds=2, at_most=2, turns=3)
FOLDER = Path(__file__).resolve().parents[1] / "tests" / "data" / "foreign_actuator"


def truths() -> dict[str, dict[str, Any]]:
    """What was hidden in each record."""
    return dict(json.loads((FOLDER / "truth.json").read_text(encoding="utf-8")))


def record(name: str) -> Record:
    """One of the records."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.csv"
        path.write_bytes(lzma.decompress((FOLDER / f"{name}.csv.xz").read_bytes()))
        return read_record(path)


def examined(name: str, n_threads: int) -> dict[str, Any]:
    """The findings on one record, with the truth and what it cost."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    begun = time.process_time()
    examination = examine(
        plant,
        measured(plant, [record(name)]),
        n_threads=n_threads,
        say=Progress(lambda t: click.echo(f"  {t}", err=True)),
    )
    cost = costs(examination.search.plant.work, time.process_time() - begun)
    findings = examination.findings
    said = findings.as_dict()
    gain = said["gain"]
    return {
        "record": name, "commit": commit(), "truth": truths()[name], "verdict": findings.verdict,
        "effects": [
            {"name": e.name, "confidence": e.confidence, "or": e.indistinguishable_from,
             "parameters": {p: [q.value, q.low, q.high] for p, q in e.parameters.items()}}
            for e in findings.effects
        ],
        "heldout": gain["heldout"], "k": gain["k_after"], "sentences": findings.sentences(), "notes": findings.notes,
        **cost,
    }  # fmt: skip


def looked_at(name: str, n_threads: int) -> dict[str, Any]:
    """What the engine says of one record, and how much nearer than the truth its fit is, or farther."""
    plant = config.load(resources.config("actuator.yaml"), Actuator)
    data = measured(plant, [record(name)])
    plant, _ = as_recorded(plant, data.signals)
    problem = ActuatorProblem(EmaPlant(plant, data, n_threads))
    begun = time.process_time()
    finder = Search(problem, BUDGET, lambda t: click.echo(f"  {time.process_time() - begun:.0f} s: {t}", err=True))
    answer = finder.run()
    leader, truth = answer.leader, truths()[name]
    point = {**truth["hidden"], **dict(zip(FAULTS, truth["k"], strict=True))}
    names = sorted({*point, *leader.hypothesis.point} & set(finder.scale.scanned))
    parameters = [p for p in finder.scale.parameters(tuple(finder.scale.known)) if p.name in names]
    x = np.array([[at.get(p.name, p.neutral) for p in parameters] for at in (point, leader.hypothesis.point)])
    of_truth, of_fit = ((finder.scale.residuals(parameters)(x) ** 2).sum(axis=1) / len(problem.measured)).tolist()
    e = leader.evidence
    fitted = zip((p.name for p in leader.parameters), e.mean.tolist(), e.sd.tolist(), strict=True)
    return {
        "record": name, "finder": "engine", "commit": commit(), "truth": truth,
        "posterior": [{"effects": e.causes, "probability": e.probability} for e in answer.posterior],
        "error_nats": answer.posterior[0].error, "p_value": answer.p_value,
        "fitted": {n: [m, sd] for n, m, sd in fitted},
        "rejected": answer.rejected, "mean_square_of_truth": of_truth, "mean_square_of_fit": of_fit,
        **costs(problem.plant.work, time.process_time() - begun),
    }  # fmt: skip


@click.command()
@click.argument("names", nargs=-1)
@click.option("--finder", type=click.Choice(["search", "engine"]), default="search", show_default=True)
@click.option("--threads", default=2, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/foreign.jsonl"), show_default=True)
def main(names: tuple[str, ...], finder: str, threads: int, out: Path) -> None:
    """Examine the records (all, or those named)."""
    out.parent.mkdir(parents=True, exist_ok=True)
    for name in names or truths():
        row = examined(name, threads) if finder == "search" else looked_at(name, threads)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
        said = row["posterior"][:3] if finder == "engine" else [row["verdict"], *(e["name"] for e in row["effects"])]
        click.echo(
            f"{name}: {said}; {row['cpu_s']:.0f} s, {row['runs']} runs, {row['times_limit']:.1f} × the kernel's limit"
        )


if __name__ == "__main__":
    main()
