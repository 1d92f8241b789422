"""`ema init`: a working folder to start from."""

from __future__ import annotations

from pathlib import Path

import click

_NAMES = ("tester", "integrator", "analyst")


@click.command(short_help="A working folder: commented configuration files, and the next three commands.")
@click.argument("words", nargs=-1, required=True, metavar="[tester|integrator|analyst] DIR")
def init(words: tuple[str, ...]) -> None:
    """Put commented configuration files into a new or an empty folder, and say what to do next.

    The tester gets a bus with a simulated actuator, the integrator the monitor's configuration, the analyst a flight
    and its report. Without a role the folder is the tester's.

    \b
    Example:
      ema init integrator work
    """
    from .working_folder import ROLES, fill

    *role, folder = words
    if len(role) > 1 or (role and role[0] not in ROLES):
        raise click.UsageError(f"say 'ema init [{'|'.join(_NAMES)}] DIR', not '{' '.join(words)}'")
    if not role and folder in ROLES:
        raise click.UsageError(f"which folder? say 'ema init {folder} DIR'")
    name = role[0] if role else _NAMES[0]
    for path in fill(Path(folder), name):
        click.echo(f"made {path}")
    click.echo("next:")
    click.echo(f"  cd {folder}")
    for why, command in ROLES[name].steps:
        click.echo(f"  {command:<60} # {why}")
