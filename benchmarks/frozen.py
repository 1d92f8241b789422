"""Trials of one commit: seeds that nobody can have developed on, and a file that holds one commit only.

Resumable: every trial is a line of the results file, and a trial that is there is not run again. First runs only: a
line is never replaced, and a file with lines of another commit, or of a changed working tree, is refused.

    python -m benchmarks.frozen --trials 300 --out var/frozen.jsonl
    python -m benchmarks.frozen --render var/frozen.jsonl
"""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from benchmarks import strata
from benchmarks.frozen_table import MixedCommitsError, history, of_one_commit, table

ROOT = Path(__file__).resolve().parents[1]
BENCHES = 100_000  # seeds of a bench's noise


def commit(of: Path = ROOT) -> str:
    """The commit under test, with ``+`` behind it where tracked files differ from it."""
    head = _git(of, "rev-parse", "HEAD")
    return head + ("+" if _git(of, "status", "--porcelain", "--untracked-files=no") else "")


def seed(commit: str, stratum: str, trial: int) -> int:
    """Seed of a trial: anybody can repeat it, and nobody knew it before the commit was made."""
    digest = hashlib.sha256(f"{commit} {stratum} {trial}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


def bench_seed(s: int) -> int:
    """The seed of the noise on a trial's bench."""
    return s % BENCHES


def _git(of: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=of, check=True, capture_output=True, text=True).stdout.strip()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """What is in a results file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def missing(of: Mapping[str, int], done: Iterable[Mapping[str, Any]]) -> Iterator[tuple[str, int]]:
    """Strata and numbers of the trials that are not there, in turn, so that an unfinished run has some of each."""
    there = {(row["stratum"], row["number"]) for row in done}
    for number in range(max(of.values())):
        for stratum, count in of.items():
            if number < count and (stratum, number) not in there:
                yield stratum, number


def begun(out: Path) -> tuple[list[dict[str, Any]], str]:
    """Rows that are there already, and the commit under test; refused where they are of another one."""
    out.parent.mkdir(parents=True, exist_ok=True)
    found, here = read_rows(out), commit()
    try:
        of_one_commit([*found, {"commit": here}])
    except MixedCommitsError as error:
        raise click.ClickException(f"{out}: {error}") from error
    return found, here


def render(rows_files: Sequence[Path], page: Path | None) -> str:
    """The table of a file of rows, or a line for each of several; put into the block of them of a page."""
    try:
        text = table(read_rows(*rows_files)) if len(rows_files) == 1 else history(map(read_rows, rows_files))
    except MixedCommitsError as error:
        raise click.ClickException(f"{' '.join(map(str, rows_files))}: {error}") from error
    if page is not None:
        name = " ".join(file.name for file in rows_files)
        page.write_text(with_block(page.read_text(encoding="utf-8"), f"frozen {name}", text), encoding="utf-8")
    return text


def with_block(page: str, name: str, text: str) -> str:
    """A page with the text in its block of that name; ClickException where it has none."""
    begin, end = f"<!-- {name} -->", "<!-- end -->"
    before, found, after = page.partition(begin)
    if not found or end not in after:
        raise click.ClickException(f"the page has no block {begin} … {end}")
    return f"{before}{begin}\n{text}\n{end}{after.partition(end)[2]}"


def run(out: Path, of: Mapping[str, int], trial: Callable[[str, int, int], dict[str, Any]]) -> None:
    """Run the trials of this commit that are missing, one line each, and print the table."""

    def told(row: dict[str, Any]) -> str:
        hidden = f"{row['stratum']} {row['number']} ({row['case']}, {row['plant']})"
        return f"{hidden}: {row['outcome']} {row.get('named')}"

    click.echo(table(run_missing(out, of, trial, told)))


def run_missing(
    out: Path,
    of: Mapping[str, int],
    trial: Callable[[str, int, int], dict[str, Any]],
    told: Callable[[dict[str, Any]], str],
) -> list[dict[str, Any]]:
    """Rows of this commit's trials: those that are missing are run, and each is told and a line of the file."""
    found, here = begun(out)
    for stratum, number in missing(of, found):
        s = seed(here, stratum, number)
        row = {"commit": here, "stratum": stratum, "number": number, "seed": s, **trial(stratum, number, s)}
        found.append(row)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        click.echo(told(row), err=True)
    return found


def command(main: Callable[..., None]) -> click.Command:
    """The options that every frozen run has."""
    options = (
        click.option("--trials", default=300, show_default=True, help="of all strata together"),
        click.option("--threads", default=2, show_default=True),
        click.option("--out", type=click.Path(path_type=Path), help="file of the rows"),
        click.option("--render", "rows_files", type=click.Path(path_type=Path, exists=True), multiple=True,
                     help="print the table of this file, and run nothing; of several files a line for each"),
        click.option("--into", type=click.Path(path_type=Path, exists=True),
                     help="with --render: put that into this page's block of the files"),
    )  # fmt: skip
    for option in options:
        main = option(main)
    return click.command()(main)


@command
def main(trials: int, threads: int, out: Path | None, rows_files: tuple[Path, ...], into: Path | None) -> None:
    """Run the trials of this commit that are missing, and print the table."""
    if rows_files:
        click.echo(render(rows_files, into))
        return
    run(out or Path("var/frozen.jsonl"), strata.counts(trials), lambda *of: _trial(*of, threads))


def _trial(stratum: str, number: int, s: int, threads: int) -> dict[str, Any]:
    from benchmarks.discrepancy import examined

    t = strata.drawn(stratum, number, s)
    bench = (t.n_cycles, bench_seed(s), t.motions, t.bench, threads, t.spoil, t.made)
    return {**t.told, **examined(t.actuator, t.case, t.values, t.k, *bench)}


if __name__ == "__main__":
    main()
