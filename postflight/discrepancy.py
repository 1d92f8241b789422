"""`ema discrepancy`: what the simulation gets wrong, the cause, the extended model, the gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ema.core.errors import ConfigError, NoCycleError, RecordError
from ema.core.files import require_new
from ema.core.folders import make_folder
from ema.core.records import Record

if TYPE_CHECKING:
    from ema.core.sidecar import Sidecar
    from ema.discrepancy.findings import Findings

N_LEADING = 3  # sets that are told


@click.command(short_help="What the simulation gets wrong: name the cause, extend the model, measure the gain.")
@click.argument("records", metavar="RECORD...", nargs=-1, type=click.Path(path_type=Path))
@click.option("--plant", "plant_file", type=click.Path(path_type=Path), help="plant YAML (kind: ema or axis)")
@click.option(
    "--out", required=True, type=click.Path(path_type=Path), help="folder of findings.json, report.html, extended.yaml"
)
@click.option("--cycles", metavar="N,N,…", help="these cycles only, as an event 'model in doubt' names them")
@click.option("--json", "as_json", is_flag=True, help="print findings.json instead of sentences")
@click.option("--explain", metavar="EFFECT", help="why not this effect? Without records: of the findings in --out")
def discrepancy(
    records: tuple[Path, ...],
    plant_file: Path | None,
    out: Path,
    cycles: str | None,
    as_json: bool,
    explain: str | None,
) -> None:
    """Compare measured RECORDs with the simulation of the plant, and say what it gets wrong and why.

    A RECORD is a CSV file, a log, or a directory of logs.

    Writes findings.json, report.html (opens offline) and extended.yaml: the plant with the effects that were found,
    which every other command accepts. Interrupted (Ctrl-C) it writes the first two with what leads by then, marked as
    unfinished. A record that agrees takes half a minute of one core; where causes are weighed against each other, it is
    one to ten.

    \b
    Examples:
      ema discrepancy --plant config/actuator.yaml flight.csv --out findings
      ema discrepancy --plant bench.yaml sine.csv rolling.csv --out findings --json
      ema discrepancy --plant actuator.yaml log --cycles 17,18,20 --out findings
      ema discrepancy --out findings --explain magnet_flux
    """
    from ema.discrepancy.explaining import explain_cause, read_findings

    from .integrity import tell
    from .plans import EXAMINERS, kind_of, plan_of

    if explain is not None and not records:
        click.echo(explain_cause(read_findings(out), explain))
        return
    if not records or plant_file is None:
        raise click.UsageError("RECORD... and --plant are needed, but with --explain of findings that are there.")
    kind = kind_of(plant_file)
    read, empty = _read(records, plan_of(plant_file))
    read = _chosen(read, cycles)
    files = [out / name for name in ("findings.json", "report.html", "extended.yaml")]
    for path in files:
        require_new(path)
    make_folder(out)
    complaints = [line for record in read for line in record.complaints]
    notes = [*_left_out(read, cycles), *empty, *complaints, *_repeated(read)]
    findings = _examined(EXAMINERS[kind], plant_file, read, records, files, notes)
    if as_json:
        click.echo(files[0].read_text(encoding="utf-8"), nl=False)
    else:
        if findings.verdict != "unfinished":  # its first sentence says so
            click.echo(f"Verdict: {findings.verdict}.")
        for sentence in findings.sentences(numbers=True):
            click.echo(sentence)
        if findings.gain.told_faults and findings.verdict != "unexplained":  # a model that is refuted tells none
            click.echo(findings.gain.told_faults)
        for line in list_leading(findings):
            click.echo(line)
        if findings.next_recording:
            click.echo(f"{findings.next_recording['sentence']}.")
        g = findings.gain
        if g.folds is not None and findings.effects:
            click.echo(g.folds.sentence(g.scale, g.unit))
        for note in findings.notes:
            click.echo(f"- {note}")
        if explain is not None:
            click.echo(explain_cause(findings.as_dict(), explain))
        click.echo(f"{files[1]}")
    if findings.verdict == "unfinished":
        raise click.Abort
    tell(complaints, [], list(records))


def _examined(
    examiner: str, plant_file: Path, read: list[Record], given: Sequence[Path], files: Sequence[Path], notes: list[str]
) -> Findings:
    """The findings, written into `files`; interrupted, what is known by then."""
    from importlib import import_module

    from ema.core import config, terminal
    from ema.core.stopping import terminated_as_interrupted
    from ema.discrepancy.extended import write_extended
    from ema.discrepancy.progress import Progress
    from ema.discrepancy.report import write_report

    findings_file, report, extended = files
    name = str(config.read_yaml(plant_file).get("name", plant_file.stem))
    records = [str(path) for path in given]
    console = terminal.console(stderr=True)
    with console.status("simulating") as status:

        def say(text: str) -> None:
            console.print(f"  {text}", highlight=False)
            status.update(text)

        progress = Progress(say, status.update)
        try:
            with terminated_as_interrupted():
                findings, draw = import_module(examiner).discrepancy(plant_file, read, progress)
        except KeyboardInterrupt:
            if not progress.tried:
                raise
            findings = progress.unfinished()
            findings.notes.extend(notes)
            findings.write(findings_file)
            write_report(report, name, records, findings, [])
            return findings
        findings.notes.extend(notes)
        findings.write(findings_file)
        write_extended(plant_file, [*findings.effects, *findings.unnamed], extended, findings.fitted)
        # Before the pictures, so that no moment of an interruption leaves findings without their report.
        write_report(report, name, records, findings, [])
        say("pictures")
        write_report(report, name, records, findings, draw())
    return findings


def _repeated(records: Sequence[Record]) -> list[str]:
    """Of records with rows that were lost and repeated: what is left may be these."""
    from ema.discrepancy.records.allowed import say_repeated
    from ema.discrepancy.records.facts import count_repeated

    return [f"{record.name}: {say_repeated(n)}" for record in records if (n := count_repeated(record))]


def list_leading(findings: Findings) -> list[str]:
    """The likeliest sets in one line."""
    from ema.discrepancy.grade import UNSOLVED

    of: dict[str, float] = {}  # of sets of the same names, as two lines of other orders, together
    for s in findings.posterior:
        name = " + ".join(s["effects"]) or findings.gain.no_cause
        of[name] = of.get(name, 0.0) + s["probability"]
    leading = sorted(of.items(), key=lambda item: -item[1])[:N_LEADING]
    told = [f"{name} {probability:.2f}" for name, probability in leading]
    which = ", if one of them is right: each leaves more than noise" if findings.verdict in UNSOLVED else ""
    return [f"Probabilities of the sets fitted{which}: {', '.join(told)}."] if told else []


def _read(paths: Sequence[Path], plan: Sidecar | None = None) -> tuple[list[Record], list[str]]:
    """The records, of directories every log in them, and what is said of logs without a whole cycle beside others."""
    from ema.core.records import each_once, read_record
    from ema.log.reader import find_logs

    found: list[Record] = []
    empty: list[NoCycleError] = []
    for path in each_once(p for given in paths for p in (find_logs(given, (".mcap",)) if given.is_dir() else [given])):
        try:
            found.append(read_record(path, plan))
        except NoCycleError as error:
            empty.append(error)
    if not found:
        raise empty[0]
    return found, [str(error) for error in empty]


def _chosen(records: list[Record], numbers: str | None) -> list[Record]:
    """The records with the cycles asked for only; those with none of them are left out."""
    if numbers is None:
        return records
    try:
        wanted = {int(number) for number in numbers.split(",")}
    except ValueError as error:
        raise ConfigError(f"--cycles {numbers}: must be cycle numbers with commas between them") from error
    chosen = [replace(r, cycles=tuple(c for c in r if c.number in wanted)) for r in records]
    if missing := wanted - {c.number for r in chosen for c in r}:
        there = sorted({c.number for r in records for c in r})
        broken = missing & {number for r in records for number in r.broken}
        why = "was left out: frames of it are missing" if broken else "is not in the records"
        raise RecordError(
            f"cycle {min(broken or missing)} {why} (there are {len(there)} whole ones: {there[0]} … {there[-1]})"
        )
    return [r for r in chosen if r.n_cycles]


def _left_out(records: list[Record], chosen: str | None) -> list[str]:
    """What is said of cycles with gaps, where all cycles were asked for."""
    told = ((r.name, len(r.broken), r.n_cycles) for r in records if r.broken and chosen is None)
    return [f"{name}: {n} of {n + n_whole} cycles have gaps and were left out" for name, n, n_whole in told]
