"""`ema identify`: faults from recorded cycles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from ema.core.names import METHODS

LEVELS = (0.5, 0.9, 0.95)


@click.command(short_help="Faults with uncertainties from recorded cycles.")
@click.option("--bundle", required=True, type=click.Path(path_type=Path), help="what `ema build` made")
@click.option("--method", type=click.Choice(METHODS), default="lf2", show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
@click.argument("records", metavar="RECORD...", nargs=-1, required=True, type=click.Path(path_type=Path))
def identify(bundle: Path, method: str, as_json: bool, records: tuple[Path, ...]) -> None:
    """Estimate the fault vector of every cycle of the records.

    With the channels theta_u and theta_m the start state of a cycle is measured, else it is left open and the
    uncertainty grows. A cycle that is not the bundle's test is said and left out. Exit status 1 if no cycle gave an
    estimate, or a log is not all that was written.

    \b
    Example:
      ema identify --bundle bundle --method lf2 cycles.csv --json
    """
    import ema.bundle
    from ema.core.errors import NegativeAnswer, RecordError
    from ema.core.records import each_once, read_record
    from ema.core.status import Status
    from ema.identification import identifier
    from ema.identification.alignment import aligned
    from ema.identification.recorded import measurements, missing

    from .integrity import tell

    made = ema.bundle.load(bundle)
    read = [aligned(read_record(path), made.plant) for path in each_once(records)]
    sets = [(record, notes, measurements(record, made.plant, made.schedule)) for record, notes in read]
    estimator = identifier(method, made)
    answers: list[dict[str, Any]] = []
    for record, notes, measured in sets:
        cycles = [
            _refused(cycle.number, m) if isinstance(m, RecordError) else _answer(cycle.number, estimator.estimate(m))
            for cycle, m in zip(record, measured, strict=True)
        ]
        answers.append(
            {
                "record": record.name,
                "missing_channels": list(missing(record)),
                "notes": notes,
                "complaints": list(record.complaints),
                "cycles": cycles,
            }
        )
    if as_json:
        click.echo(json.dumps({"method": method, "bundle": str(bundle), "records": answers}, indent=1))
    else:
        for answer in answers:
            _say(answer)
    if all(c["status"] == Status.NOT_ESTIMATED.name.lower() for a in answers for c in a["cycles"]):
        raise NegativeAnswer("no cycle gave an estimate")
    tell([line for record, _ in read for line in record.complaints], [], [Path(r.name) for r, _ in read])


def _answer(number: int, e: Any) -> dict[str, Any]:
    from ema.core.names import FAULTS

    return {
        "cycle": number,
        "k": _finite(e.k),
        "sd": _finite(e.sd),
        "intervals": {f"{level:g}": [_finite(row) for row in e.interval(level)] for level in LEVELS},
        "status": e.status.name.lower(),
        "reasons": e.reasons.names,
        "p_value": _finite([e.p_value])[0],
        "chi2": _finite([e.chi2])[0],
        "dof": e.dof,
        "unseparable": [dict(zip(FAULTS, map(float, d.round(3)), strict=True)) for d in e.unseparable],
        **({"nuisance": _nuisance(e.nuisance)} if e.nuisance else {}),
    }


def _nuisance(beside: Any) -> dict[str, Any]:
    """What was estimated beside the faults, by name."""
    return {
        name: {"value": float(value), "sd": float(sd), "low": float(low), "high": float(high), "unit": unit}
        for name, unit, value, sd, (low, high) in zip(
            beside.names, beside.units, beside.value, beside.sd, beside.interval95, strict=True
        )
    }


def _refused(number: int, why: Exception) -> dict[str, Any]:
    from ema.core.status import Status

    return {"cycle": number, "status": Status.NOT_ESTIMATED.name.lower(), "reasons": [], "refused": str(why)}


def _finite(values: Any) -> list[float | None]:
    """Numbers for JSON, which knows no NaN."""
    return [float(v) if v == v else None for v in values]


def _say(answer: dict[str, Any]) -> None:
    from ema.core.names import FAULTS

    click.echo(answer["record"])
    for note in answer["notes"]:
        click.echo(f"  {note.removeprefix(answer['record'] + ': ')}")
    if answer["missing_channels"]:
        click.echo(f"  not measured: {', '.join(answer['missing_channels'])}")
    click.echo("  cycle  " + "".join(f"{fault:^17}" for fault in FAULTS) + "  p-value  status")
    for c in answer["cycles"]:
        if c["status"] == "not_estimated":
            click.echo(f"  {c['cycle']:>5}  not estimated: {c.get('refused') or ', '.join(c['reasons'])}")
            continue
        values = "".join(f" {k:.4f} ± {sd:.4f} " for k, sd in zip(c["k"], c["sd"], strict=True))
        reasons = f" ({', '.join(c['reasons'])})" if c["reasons"] else ""
        click.echo(f"  {c['cycle']:>5}  {values}  {c['p_value']:7.4f}  {c['status']}{reasons}")
        for name, n in c.get("nuisance", {}).items():
            unit = "" if n["unit"] == "1" else f" {n['unit']}"
            click.echo(
                f"         beside the faults: {name} = {n['value']:.4g} ± {n['sd']:.2g}{unit} "
                f"(95 %: {n['low']:.4g} … {n['high']:.4g})"
            )
        for direction in c["unseparable"]:
            terms = " ".join(f"{v:+.2f} {name}" for name, v in direction.items() if abs(v) > 0.1)
            click.echo(f"         cannot be separated: {terms}")
