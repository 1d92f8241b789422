"""Records of a simulator of another hand (`tests/data/foreign_actuator`), examined: what comes back.

    python -m benchmarks.foreign recorder_gain late_position --out var/foreign.jsonl

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

from benchmarks.frozen import commit
from benchmarks.kernel import costs
from ema.core import config, resources
from ema.core.records import Record, read_record
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.progress import Progress
from ema.models.actuator import Actuator

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
        prepare(plant, [record(name)]),
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


@click.command()
@click.argument("names", nargs=-1)
@click.option("--threads", default=2, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/foreign.jsonl"), show_default=True)
def main(names: tuple[str, ...], threads: int, out: Path) -> None:
    """Examine the records (all, or those named)."""
    out.parent.mkdir(parents=True, exist_ok=True)
    for name in names or truths():
        row = examined(name, threads)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
        said = [row["verdict"], *(e["name"] for e in row["effects"])]
        click.echo(
            f"{name}: {said}; {row['cpu_s']:.0f} s, {row['runs']} runs, {row['times_limit']:.1f} × the kernel's limit"
        )


if __name__ == "__main__":
    main()
