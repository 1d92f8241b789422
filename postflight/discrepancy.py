"""`ema discrepancy`: what the simulation gets wrong, the cause, the extended model, the gain."""

from __future__ import annotations

from pathlib import Path

import click

from ema.core.errors import ConfigError

# Which module examines which kind of plant.
EXAMINERS = {"ema": "ema.discrepancy.actuator", "axis": "ema.discrepancy.axis"}


@click.command(short_help="What the simulation gets wrong: name the cause, extend the model, measure the gain.")
@click.argument("records", metavar="RECORD...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--plant", "plant_file", required=True, type=click.Path(path_type=Path), help="plant YAML (kind: ema or axis)"
)
@click.option(
    "--out", required=True, type=click.Path(path_type=Path), help="folder of findings.json, report.html, extended.yaml"
)
@click.option("--json", "as_json", is_flag=True, help="print findings.json instead of sentences")
def discrepancy(records: tuple[Path, ...], plant_file: Path, out: Path, as_json: bool) -> None:
    """Compare measured RECORDs with the simulation of the plant, and say what it gets wrong and why.

    Writes findings.json, report.html (opens offline) and extended.yaml: the plant with the effects that were found,
    which every other command accepts.

    \b
    Examples:
      ema discrepancy --plant config/actuator.yaml flight.csv --out findings
      ema discrepancy --plant bench.yaml sine.csv rolling.csv --out findings --json
    """
    from importlib import import_module

    from rich.console import Console

    from ema.core import config
    from ema.core.records import read_record
    from ema.discrepancy.extended import write_extended
    from ema.discrepancy.report import write_report

    kind = config.read_yaml(plant_file).get("kind")
    if kind not in EXAMINERS:
        raise ConfigError(f"{plant_file}: key 'kind' = {kind!r}: must be one of {', '.join(EXAMINERS)}")
    examiner = import_module(EXAMINERS[kind])
    read = [read_record(path) for path in records]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{out}: cannot be made ({error.strerror})") from error
    console = Console(stderr=True)
    with console.status("simulating") as status:

        def say(text: str) -> None:
            console.print(f"  {text}", highlight=False)
            status.update(text)

        findings, draw = examiner.discrepancy(plant_file, read, say)
        findings.write(out / "findings.json")
        write_extended(plant_file, findings.effects, out / "extended.yaml", findings.fitted)
        say("pictures")
        name = str(config.read_yaml(plant_file).get("name", plant_file.stem))
        write_report(out / "report.html", name, [str(path) for path in records], findings, draw())
    if as_json:
        click.echo((out / "findings.json").read_text(encoding="utf-8"), nl=False)
    else:
        for sentence in findings.sentences():
            click.echo(sentence)
        click.echo(f"{out / 'report.html'}")
