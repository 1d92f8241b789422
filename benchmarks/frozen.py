"""Trials of one commit: seeds that nobody can have developed on, and a file that holds one commit only.

Resumable: every trial is a line of the results file, and a trial that is there is not run again. First runs only: a
line is never replaced, and a file with lines of another commit, or of a changed working tree, is refused.

    python -m benchmarks.frozen --trials 300 --out var/frozen.jsonl
"""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
from scipy.stats import beta

from benchmarks import strata

ROOT = Path(__file__).resolve().parents[1]
CONFIDENT = 0.9


class MixedCommitsError(Exception):
    """Rows of several commits, or of a changed working tree, are not one experiment."""


def commit() -> str:
    """The commit under test, with ``+`` behind it where tracked files differ from it."""
    head = _git("rev-parse", "HEAD")
    return head + ("+" if _git("status", "--porcelain", "--untracked-files=no") else "")


def seed(commit: str, stratum: str, trial: int) -> int:
    """Seed of a trial: anybody can repeat it, and nobody knew it before the commit was made."""
    digest = hashlib.sha256(f"{commit} {stratum} {trial}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


def of_one_commit(rows: Iterable[Mapping[str, Any]]) -> str:
    """The commit of all rows; MixedCommitsError where there is none."""
    commits = sorted({str(row.get("commit")) for row in rows})
    if len(commits) != 1:
        raise MixedCommitsError(f"rows of {len(commits)} commits ({', '.join(c[:9] for c in commits)}): must be of one")
    if commits[0].endswith("+") or commits[0] == "None":
        raise MixedCommitsError(f"rows of {commits[0]}: a changed working tree cannot be repeated; commit first")
    return commits[0]


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """What is in a results file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def missing(n: int, done: Iterable[Mapping[str, Any]]) -> Iterator[tuple[str, int]]:
    """Strata and numbers of the trials that are not there, in turn, so that an unfinished run has some of each."""
    there = {(row["stratum"], row["number"]) for row in done}
    of = strata.counts(n)
    for number in range(max(of.values())):
        for stratum, count in of.items():
            if number < count and (stratum, number) not in there:
                yield stratum, number


def table(found: list[dict[str, Any]]) -> str:
    """The results of one commit by stratum, with 95 % intervals; MixedCommitsError where they are of several."""
    lines = [f"commit {of_one_commit(found)}, {len(found)} trials"]
    for stratum in dict.fromkeys(row["stratum"] for row in found):
        these = [row for row in found if row["stratum"] == stratum]
        seen = [row for row in these if row["outcome"] != "refused"]
        good = sum(row["outcome"] in ("right", "in set") for row in seen)
        wrong = sum(row["outcome"] == "wrong" and max(row["confidence"], default=0.0) >= CONFIDENT for row in seen)
        lines.append(
            f"{stratum:20s} right or in set: {rate(good, len(seen))}; confidently wrong: {rate(wrong, len(seen))}; "
            f"refused {len(these) - len(seen)}"
        )
    seen = [row for row in found if row["outcome"] != "refused"]
    inside = [x for row in seen for x in row["covered"].values()]
    invented = sum(any(k > 0.01 and true == 0.0 for k, true in zip(r["k_after"], r["k"], strict=True)) for r in seen)
    lines.append(f"95 % intervals that hold the truth: {rate(sum(inside), len(inside))}")
    lines.append(f"trials with a fault above 1 % that is not there: {rate(invented, len(seen))}")
    cpu = [row["cpu_s"] for row in seen] or [np.nan]
    lines.append(f"processor time: median {np.median(cpu):.0f} s, 99 %: {np.quantile(cpu, 0.99):.0f} s")
    return "\n".join(lines)


def rate(count: int, n: int) -> str:
    """A share with its interval of 95 % (Jeffreys)."""
    low, high = (float(x) for x in beta.interval(0.95, count + 0.5, n - count + 0.5))
    return f"{count} of {n} ({low:.1%} to {high:.1%})"


def begun(out: Path) -> tuple[list[dict[str, Any]], str]:
    """Rows that are there already, and the commit under test; refused where they are of another one."""
    out.parent.mkdir(parents=True, exist_ok=True)
    found, here = read_rows(out), commit()
    try:
        of_one_commit([*found, {"commit": here}])
    except MixedCommitsError as error:
        raise click.ClickException(f"{out}: {error}") from error
    return found, here


@click.command()
@click.option("--trials", default=300, show_default=True, help="of all strata together")
@click.option("--threads", default=2, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/frozen.jsonl"), show_default=True)
def main(trials: int, threads: int, out: Path) -> None:
    """Run the trials of this commit that are missing, and print the table."""
    from benchmarks.discrepancy import examined

    found, here = begun(out)
    for stratum, number in missing(trials, found):
        s = seed(here, stratum, number)
        t = strata.drawn(stratum, number, s)
        row = {
            "commit": here, "stratum": stratum, "number": number, "seed": s, "case": t.case, "plant": t.plant,
            "record": t.record,
            **examined(
                t.actuator, t.case, t.values, t.k, t.n_cycles, s % 100_000, t.motions, t.bench, threads, t.spoil
            ),
        }  # fmt: skip
        found.append(row)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        click.echo(f"{stratum} {number} ({t.case}, {t.plant}): {row['outcome']} {row.get('named')}", err=True)
    click.echo(table(found))


if __name__ == "__main__":
    main()
