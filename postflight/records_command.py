"""`ema records check`: what a foreign record holds and allows."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ema.core.records import Record

PICTURES = (".svg", ".png", ".pdf")
UNEVEN = 0.02  # by which the mean rate differs from that of most steps and is told too
SEE_IT = "see it, or move it away"


@click.group(short_help="Foreign records: what they hold, whether it agrees, what it allows.")
def records() -> None:
    """Look at records before anything is simulated.

    \b
    Example:
      ema records check bench.csv
    """


@records.command(short_help="Channels, clock, agreement, and what can be identified.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--plant",
    type=click.Path(path_type=Path),
    help="plant YAML: what drives, and in its key 'record' what the columns are",
)
@click.option("--picture", type=click.Path(path_type=Path), help="SVG or PNG with every channel over time")
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
def check(files: tuple[Path, ...], plant: Path | None, picture: Path | None, as_json: bool) -> None:
    """Say what each FILE has: channels, rate, jitter, gaps, clipping, steps, noise, whether channels agree, and what it
    can and cannot identify. With --plant it is looked at as a record of that plant, and what `ema discrepancy` would
    refuse is told. Exit status 1 if a file is enough for no plant, or not for the one that is given.

    \b
    Examples:
      ema records check flight.csv
      ema records check bench.csv --plant bench.yaml
      ema records check bench.csv --picture bench.svg --json
    """
    from ema.core.errors import ConfigError, NegativeAnswer
    from ema.core.files import require_new
    from ema.core.records import each_once, read_record
    from ema.discrepancy.records import agreements, channels, list_allowed, sampling

    from .plans import axis_of, kind_of, plan_of

    if picture is not None and require_new(picture, "choose another --picture").suffix.lower() not in PICTURES:
        raise ConfigError(f"{picture}: must end in .svg, .png or .pdf")
    plan = None if plant is None else plan_of(plant)
    axis = None if plant is None else axis_of(plant)
    kind = None if plant is None else kind_of(plant)
    found, answers = [], []
    for path in each_once(files):
        record = read_record(path, plan)
        clock, facts, agree = sampling(record), channels(record), agreements(record)
        able = list_allowed(record, clock, facts, agree, axis)
        able = able if kind is None else able.only(kind)
        found.append(record)
        answers.append((record, clock, facts, agree, able))
    if as_json:
        click.echo(json.dumps([_as_dict(*answer) for answer in answers], indent=2, ensure_ascii=False))
    else:
        for answer in answers:
            _tell(*answer)
    if picture is not None:
        from .records_picture import draw

        draw(found, picture)
        click.echo(str(picture), err=as_json)
    useless = [record.name for record, *_, able in answers if not able.plants or able.refused]
    if useless:
        raise NegativeAnswer(
            f"{', '.join(useless)}: enough for {'no plant' if plant is None else f'no search by {plant}'}"
        )


@records.command("map", short_help="Propose what the columns of a stranger's file are.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--write", is_flag=True, help="write it beside FILE, as NAME.record.yaml; must not exist")
def map_columns(file: Path, write: bool) -> None:
    """Propose a sidecar for FILE by its titles and units: what each column is, and what to look at. Read it, mend it:
    nothing is read by a guess unless the sidecar says so. Exit status 1 if no column looks like a time, and none like
    what holds an axis in its place.

    \b
    Examples:
      ema records map bench.csv
      ema records map bench.csv --write
    """
    from ema.core import sidecar
    from ema.core.errors import NegativeAnswer
    from ema.core.files import require_new, write_new
    from ema.discrepancy.records.naming import propose

    from .proposed_sidecar import as_sidecar, table_of

    table, side = table_of(file)
    proposals = propose(table)
    beside = sidecar.beside(file)
    if write:
        require_new(beside, SEE_IT)
    seen = {one.channel for one in proposals}
    moves = bool(seen & {"w_m", "v", "w_ref", "theta_ref", "q_ref"})  # what is held at rest has no speed and no command
    if "t" not in seen and seen & {"theta_m", "q"} and seen & {"i_q", "torque", "force"} and not moves:
        side = side.model_copy(update={"at_rest": True})  # what holds the axis, over its place
    text = as_sidecar(file.name, proposals, side)
    if "t" not in seen and not side.at_rest:
        click.echo(text, nl=False)
        raise NegativeAnswer(
            f"{file}: no column looks like a time; map one by hand (a counter: {{channel: t, unit: s, scale: PERIOD}})"
        )
    if not write:
        click.echo(text, nl=False)
        return
    write_new(beside, text, SEE_IT)
    click.echo(f"made {beside}: read it, and mend what is not so")
    click.echo(f"next: ema records check {file}")


def _as_dict(record: Record, clock: Any, facts: Any, agree: Any, able: Any) -> dict[str, Any]:
    return {
        "file": record.name,
        "sampling": asdict(clock),
        "channels": [asdict(one) for one in facts],
        "not_understood": list(record.ignored),
        "agreements": [asdict(one) for one in agree],
        "plants": able.plants,
        "missing": able.missing,
        "obstacles": able.obstacles,
        "refused": able.refused,
    }


def _tell(record: Record, clock: Any, facts: Any, agree: Any, able: Any) -> None:
    click.echo(f"{record.name}: {clock.n_cycles} cycles, {_say_clock(record, clock)}")
    click.echo(f"  {'channel':<10} {'unit':<6} {'from':>11} {'to':>11} {'step':>10} {'noise':>10}  remark")
    for one in facts:
        remark = "constant" if one.is_constant else f"{100 * one.held:.1f} % at an end" if one.held else ""
        step = f"{one.step:10.3g}" if one.step else f"{'-':>10}"
        noise = f"{one.noise:10.3g}" if one.noise else f"{'-':>10}"
        line = f"  {one.name:<10} {one.unit:<6} {one.low:11.5g} {one.high:11.5g} {step} {noise}  {remark}"
        click.echo(line.rstrip())
    if record.ignored:
        click.echo(f"  not understood: {', '.join(record.ignored)}")
    for one in agree:
        click.echo(f"  {'ok' if one.is_fine else 'look':<5} {one.what}: {one.said}")
    for kind, what in able.plants.items():
        click.echo(f"  can be examined as kind: {kind}: {what}")
    for kind, what in able.missing.items():
        click.echo(f"  not as kind: {kind}: {', '.join(what)} missing")
    for obstacle in able.obstacles:
        click.echo(f"  in the way: {obstacle}")
    if able.refused:
        click.echo(f"  refused by 'ema discrepancy' with this plant file: {able.refused}")


def _say_clock(record: Record, clock: Any) -> str:
    if record.is_at_rest:
        return f"{clock.n_samples} readings at rest"
    rate = 1.0 / clock.period
    mean = (clock.n_samples - clock.n_cycles) / max(clock.duration, clock.period)
    told = f"{rate:.6g} Hz" if abs(mean / rate - 1.0) < UNEVEN else f"{rate:.6g} Hz ({mean:.4g} Hz on average)"
    return f"{clock.n_samples} samples, {clock.duration:.4g} s, {told}, jitter {100 * clock.jitter:.1f} % of the period"
