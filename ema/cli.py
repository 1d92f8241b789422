"""The `ema` command. Subcommands are registered by the programs as entry points of the group `ema.commands`.

Exit status: 0 done; 1 a negative answer, a failed check, or a service that cannot go on; 2 wrong use or bad input, told
in one line.
"""

from __future__ import annotations

import os
import sys
from importlib.metadata import entry_points
from typing import Any, NoReturn

import click

from ema.core.errors import ConfigError, EmaError, Failure, NegativeAnswer
from ema.core.version import version

# Before numpy is loaded: matrices here are small, and threads of a linear algebra library that wait for each other cost
# a linear answer several times its own work. Cores are used by processes and kernels instead.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class _Programs(click.Group):
    """A group whose commands are loaded only when they are called or listed."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted({entry.name for entry in entry_points(group="ema.commands")})

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        for entry in entry_points(group="ema.commands", name=name):
            command: Any = entry.load()
            return command
        return None

    def invoke(self, ctx: click.Context) -> Any:
        """Run the subcommand; what its extra would have brought and is not here, is said in one line."""
        try:
            return super().invoke(ctx)
        except ModuleNotFoundError as error:
            if (error.name or "ema").split(".")[0].startswith("ema"):
                raise
            name = str(ctx.invoked_subcommand)
            (entry,) = entry_points(group="ema.commands", name=name)
            extra = f"[{','.join(entry.extras)}]" if entry.extras else ""
            raise ConfigError(
                f"{name}: the package '{error.name}' is not installed: python -m pip install 'ema-monitor{extra}'"
            ) from error


def _tell_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    """Ask for the version only when it is wanted: in a checkout that takes a call of git."""
    if wanted:
        click.echo(f"ema {version()}")
        ctx.exit()


@click.group(cls=_Programs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_tell_version, help="Show the version."
)
def cli() -> None:
    """Find faults of an electromechanical flight-control actuator in its motor currents."""


def main() -> NoReturn:
    """Run the command line; every error of use is one line on standard error."""
    try:
        status = cli.main(standalone_mode=False, prog_name="ema")
        sys.exit(status if isinstance(status, int) else 0)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.Abort:
        _fail("interrupted", 130)
    except KeyboardInterrupt:
        _fail("interrupted", 130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        name = context.command_path if context else "ema"
        if isinstance(error, click.exceptions.NoArgsIsHelpError):
            click.echo(error.format_message())
            sys.exit(2)
        _fail(f"{error.format_message()} (see '{name} --help')", 2)
    except (NegativeAnswer, Failure) as error:
        _fail(str(error), 1)
    except EmaError as error:
        _fail(str(error), 2)


def _fail(message: str, status: int) -> NoReturn:
    click.echo("ema: " + " ".join(message.split()), err=True)
    sys.exit(status)
