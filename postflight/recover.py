"""`ema recover`: finished copies of unfinished or damaged logs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from ema.core.errors import LogError, NegativeAnswer
from ema.core.folders import make_folder


@click.command(short_help="Finished copies of unfinished or damaged logs.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", metavar="DIR", type=click.Path(path_type=Path), help="Where to write (default: beside the log).")
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
def recover(logs: tuple[Path, ...], out: Path | None, as_json: bool) -> None:
    """Write a finished copy, NAME.recovered.mcap, of each unfinished or damaged MCAP log.

    LOG is a file or a directory of files. All that is in a log is compared with what it says of itself. The log itself
    is never changed and nothing is overwritten; one that is finished and sound is left as it is.

    Exit status 0: every log is finished and sound. 1: one was not, and its copy is there. 2: one cannot be read, or its
    copy cannot be written.

    \b
    Example:
      ema recover /var/log/ema/ema-20250314T091500000Z-0003.mcap
    """
    from ema.log.reader import COPY_SUFFIX, find_logs

    if out is not None:
        make_folder(out)
    answers: list[dict[str, object]] = []
    failures = []
    for path in find_logs(logs, (".mcap",)):
        if path.name.endswith(COPY_SUFFIX) and path not in logs:
            continue
        try:
            answers.append(_one(path, (out or path.parent) / (path.stem + COPY_SUFFIX)))
        except LogError as error:
            failures.append(error)
            answers.append({"log": str(path), "error": str(error)})
        else:
            if not as_json:
                click.echo(answers[-1]["text"])
    if as_json:
        click.echo(json.dumps(answers, indent=2))
    for failure in failures[:-1]:
        click.echo(f"ema: {failure}", err=True)
    if failures:
        raise failures[-1]
    recovered = sum(answer.get("recovered") is not None for answer in answers)
    if recovered:
        raise NegativeAnswer(f"{recovered} of {len(answers)} logs were not finished and sound; copies were written")


def _one(path: Path, target: Path) -> dict[str, object]:
    from ema.log.recovery import is_sound, recover

    if is_sound(path):
        return {"log": str(path), "recovered": None, "text": f"{path}: finished and sound, nothing to recover"}
    found = recover(path, target)
    span = f" over {(found.last_ns - found.first_ns) / 1e9:.1f} s" if found.first_ns and found.last_ns else ""
    lines = [f"{target}: {found.messages} messages{span}", *(f"  {damage}" for damage in found.damage)]
    return {
        "log": str(path),
        "recovered": str(target),
        "messages": found.messages,
        "first_ns": found.first_ns,
        "last_ns": found.last_ns,
        "damage": [str(damage) for damage in found.damage],
        "missing": [missing._asdict() for missing in found.missing],
        "text": "\n".join(lines),
    }
