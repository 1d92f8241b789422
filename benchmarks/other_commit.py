"""Frozen trials by the finder of another commit, so that two finders stand beside each other on the same records.

    git worktree add /tmp/old ee42f01 && make -C /tmp/old env
    python -m benchmarks.other_commit benchmarks/trials/frozen-28dc0c0.jsonl --checkout /tmp/old --out var/old.jsonl

Both are given what the rows' seeds draw. The other one gets it as files, a plant file and a CSV record, by its own
command `ema discrepancy`: what a command reads and writes is all that commits have in common. Resumable, as `frozen`;
prints both beside each other, and runs nothing without a checkout. Rows whose strata were drawn by other code than
this commit's need the benchmarks of the commit that drew them.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from benchmarks import discrepancy, frozen, frozen_axis, strata, strata_axis
from benchmarks.frozen_table import beside
from ema.core.csv_records import write_csv
from ema.core.records import Record

WRONG_INPUT = 2  # exit status of `ema`
Beside = Callable[[dict[str, Any]], dict[str, Any]]
"""From findings.json to a row: what was found beside what was hidden."""


def as_given(row: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any], tuple[Record, ...], Beside]:
    """The trial of a row: what it hides, the plant file, the records, and what lays findings beside the truth."""
    of = row["stratum"], row["number"], row["seed"]
    if row["stratum"] in strata_axis.STRATA and "k" not in row:
        t = strata_axis.drawn(*of)
        return t.told, t.plant_file, t.records, lambda said: frozen_axis.beside_truth(t, said)
    a = strata.drawn(*of)
    bench = (a.n_cycles, frozen.bench_seed(row["seed"]), a.motions, a.bench)
    record = discrepancy.recorded(a.values, a.k, *bench, a.spoil)
    told = {**a.told, "hidden": a.values, "k": a.k}
    file = {"kind": "ema", **a.actuator.model_dump(mode="json", exclude_defaults=True, by_alias=True)}
    return told, file, (record,), lambda said: discrepancy.beside_truth(a.case, a.values, a.k, *bench, said, a.made)


def examined_by(checkout: Path, plant_file: dict[str, Any], records: tuple[Record, ...]) -> dict[str, Any]:
    """findings.json as the commit in `checkout` writes it, or the row's "outcome" and what was "said" instead."""
    with tempfile.TemporaryDirectory() as folder:
        plant, out = Path(folder) / "plant.yaml", Path(folder) / "findings"
        plant.write_text(json.dumps(plant_file, default=float), encoding="utf-8")  # JSON is YAML
        files = [Path(folder) / f"record-{k + 1}.csv" for k in range(len(records))]
        for record, file in zip(records, files, strict=True):
            write_csv(record, file)
        words = ["discrepancy", *map(str, files), "--plant", str(plant), "--out", str(out)]
        here = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        told = subprocess.run(
            [checkout / ".venv/bin/ema", *words], cwd=checkout, env=here, capture_output=True, text=True
        )
        if not (out / "findings.json").exists():
            failed = {"outcome": "crashed", "verdict": "crashed", "named": [], "confidence": [], "z": {}}
            refused = {"outcome": "refused"} if told.returncode == WRONG_INPUT else failed
            return {**refused, "said": told.stderr.strip().splitlines()[-1:]}
        return dict(json.loads((out / "findings.json").read_text(encoding="utf-8")))


@click.command()
@click.argument("rows_file", type=click.Path(path_type=Path, exists=True))
@click.option(
    "--checkout",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="clone of the other commit, with its own environment (make env)",
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="file of its rows")
@click.option("--into", type=click.Path(path_type=Path, exists=True), help="put the table into this page's block")
def main(rows_file: Path, checkout: Path | None, out: Path, into: Path | None) -> None:
    """Give the trials of ROWS_FILE to another commit, and print what both say of them."""
    if checkout is not None:
        run(rows_file, checkout, out)
    click.echo(render(rows_file, out, into))


def run(rows_file: Path, checkout: Path, out: Path) -> None:
    """Give the other commit the trials that are missing, one line each."""
    commit = frozen.commit(checkout)
    done = {(row["stratum"], row["number"]) for row in frozen.read_rows(out)}
    for row in frozen.read_rows(rows_file):
        if (row["stratum"], row["number"]) in done:
            continue
        told, plant_file, records, beside_truth = as_given(row)
        begun = children_s()
        said = examined_by(checkout, plant_file, records)
        own = {"commit": commit, **{name: row[name] for name in ("stratum", "number", "seed")}, **told}
        found = said if "outcome" in said else beside_truth(said)
        own |= {**found, "cpu_s": children_s() - begun}
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(own) + "\n")
        answer = f"{own['outcome']} {own.get('named', own.get('said'))}"
        click.echo(f"{row['stratum']} {row['number']} ({own['case']}): {answer}", err=True)


def render(rows_file: Path, out: Path, page: Path | None) -> str:
    """Both commits beside each other; put into the page's block of these files where one is given."""
    text = beside(frozen.read_rows(rows_file), frozen.read_rows(out))
    if page is not None:
        block = f"frozen {rows_file.name} beside {out.name}"
        page.write_text(frozen.with_block(page.read_text(encoding="utf-8"), block, text), encoding="utf-8")
    return text


def children_s() -> float:
    """Processor time of the processes that ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
