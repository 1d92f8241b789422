"""Records of real benches (`tests/data/benches.yaml`) through `ema discrepancy`, beside what their makers published.

    python -m benchmarks.real_benches --out var/real.jsonl
    python -m benchmarks.real_benches --render var/real.jsonl --into docs/real-data.md

Every bench is a line of the results file, of one commit; a line that is there is not run again.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import yaml

from benchmarks.frozen import ROOT, begun, read_rows
from benchmarks.frozen_table import MixedCommitsError
from benchmarks.other_commit import children_s
from benchmarks.real_tables import fill

DATA = ROOT / "tests" / "data"
KEPT = ("verdict", "effects", "gain", "structure", "balance", "rest")  # of findings.json
G = 9.81  # m/s^2, as in the makers' files


def benches() -> list[dict[str, Any]]:
    """What is examined: bench, plant file, records, and where the makers' numbers are."""
    return list(yaml.safe_load((DATA / "benches.yaml").read_text(encoding="utf-8")))


def published(p: Mapping[str, float], joint: str) -> dict[str, float]:
    """The coefficients of a joint's balance by the makers' parameters of a double pendulum (their `dynamics.rst`).

    Lengths m, masses kg, inertias kg m^2; their dry friction is c_f arctan(100 ω), whose end is π/2 c_f.
    """
    coupling = p["m2"] * p["l1"] * p["r2"]
    outer = p["I2"] + p["gr"] ** 2 * p["Ir"]
    whole = p["I1"] + p["I2"] + p["m2"] * p["l1"] ** 2 + (p["gr"] ** 2 + 1.0) * p["Ir"]
    of = {
        "linked_axis.coupling": coupling,
        "linked_axis.inertia": p["I2"] - p["gr"] * p["Ir"],
        "linked_axis.gravity_outer": p["m2"] * p["r2"] * G,
    }
    if joint == "elbow":
        return {"inertia": outer, **of, "dry_friction": math.pi / 2 * p["cf2"], "viscous_drag": p["b2"]}
    inner = {"linked_axis.gravity": (p["m1"] * p["r1"] + p["m2"] * p["l1"]) * G}
    return {"inertia": whole, **of, **inner, "dry_friction": math.pi / 2 * p["cf1"], "viscous_drag": p["b1"]}


def examined(bench: dict[str, Any]) -> dict[str, Any]:
    """What `ema discrepancy` says of a bench, its exit status and the processor time it took."""
    plant = ROOT / bench["plant"] if bench["plant"].startswith("config/") else DATA / bench["plant"]
    files = [str(DATA / name) for name in bench["records"]]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "findings"
        words = ["discrepancy", "--plant", str(plant), *files, "--out", str(out)]
        begin = children_s()
        run = subprocess.run(
            [Path(sys.executable).with_name("ema"), *words], capture_output=True, text=True, check=False
        )
        cost = children_s() - begin
        told = out / "findings.json"
        found = json.loads(told.read_text(encoding="utf-8")) if told.exists() else {}
    row: dict[str, Any] = {"bench": bench["bench"], "records": bench["records"], "exit": run.returncode, "cpu_s": cost}
    row["said"] = "" if found else run.stderr.strip().splitlines()[-1].replace(f"{DATA}/", "")
    row |= {key: found[key] for key in KEPT if key in found}
    if of := bench.get("published"):
        makers = yaml.safe_load((DATA / of["file"]).read_text(encoding="utf-8"))
        row["published"] = published(makers, of["joint"])
    return row


@click.command()
@click.option("--out", default="var/real.jsonl", show_default=True, type=click.Path(path_type=Path))
@click.option(
    "--render", "rows_file", type=click.Path(path_type=Path, exists=True), help="run nothing, print the tables"
)
@click.option("--into", type=click.Path(path_type=Path, exists=True), help="with --render: put them into this page")
def main(out: Path, rows_file: Path | None, into: Path | None) -> None:
    """Examine the benches that are missing in the file, or render its tables."""
    if rows_file is not None:
        try:
            text = fill(read_rows(rows_file), into.read_text(encoding="utf-8") if into else None)
        except MixedCommitsError as error:
            raise click.ClickException(f"{rows_file}: {error}") from error
        into.write_text(text, encoding="utf-8") if into else click.echo(text)
        return
    rows, here = begun(out)
    there = {(row["bench"], *row["records"]) for row in rows}
    for bench in benches():
        if (bench["bench"], *bench["records"]) in there:
            continue
        row = {"commit": here, **examined(bench)}
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
        click.echo(f"{bench['bench']} {', '.join(bench['records'])}: {row.get('verdict', row['said'])}", err=True)


if __name__ == "__main__":
    main()
