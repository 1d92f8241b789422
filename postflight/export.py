"""`ema export`: logs as tables for other tools, or as raw logs of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from ema.core.errors import LogError

from .times import TimeOption, time_range

_TABLES = ("estimates", "envelopes", "events", "status")
_WHAT = (*_TABLES, "signals", "cycles")


@click.command(short_help="Logs as tables, records, or raw logs of other tools.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--out", metavar="PATH", required=True, type=click.Path(path_type=Path),
    help="Directory for tables, or a file NAME.asc, .blf, .log, .trc, .mf4, .db or .mcap for raw frames.",
)  # fmt: skip
@click.option("--format", "kind", type=click.Choice(["csv", "parquet"]), default="csv", show_default=True)
@click.option(
    "--what",
    multiple=True,
    type=click.Choice(_WHAT),
    help="Which tables (default: the first four).",
)
@click.option(
    "--signals", is_flag=True,
    help="Plain numeric series for plotting, to NAME.mcap, NAME.mf4 or a directory of tables.",
)  # fmt: skip
@time_range
def export(
    logs: tuple[Path, ...],
    out: Path,
    kind: str,
    what: tuple[str, ...],
    signals: bool,
    start: TimeOption,
    end: TimeOption,
) -> None:
    """Write estimates, envelopes, events, status and decoded signals as tables with units in the header.

    The cycles of each actuator become a record that `ema identify` and `ema discrepancy` read. With a file name of
    another tool as --out, the raw frames go there. With --signals everything that is a number becomes a series that
    Foxglove, PlotJuggler, asammdf and pandas plot: currents, positions, envelope, estimates with intervals, alarms.

    Nothing is overwritten. What was written is read back and counted; what a format cannot hold is refused.

    \b
    Examples:
      ema export /var/log/ema --out tables
      ema export flight.mcap --out tables --format parquet --what estimates --what signals
      ema export flight.mcap --out records --what cycles
      ema export flight.mcap --out flight.blf --start 10 --end 20
      ema export flight.mcap --signals --out flight.signals.mcap
    """
    from .integrity import conclude
    from .open_log import open_log, open_mcap

    if signals:
        if what:
            raise click.UsageError("--signals are all there are: --what does not go with it")
        _signals(logs, out, kind, start, end)
        return
    if out.suffix:
        from .raw_logs import write_frames

        if what:
            raise click.UsageError("--what names tables, and those need a directory as --out")
        with open_log(logs, start, end) as log:
            click.echo(f"{out}: {write_frames(log, out)} frames, read back and compared")
            conclude(log)
            return
    from .table_files import TableFiles
    from .tables import codec_of, cycle_blocks, message_blocks, signal_blocks

    wanted = set(what or _TABLES)
    with open_mcap(logs, start, end) as log:
        with TableFiles(out, kind) as files:
            for block in message_blocks(log, wanted):
                files.write(block)
            if "signals" in wanted:
                for block in signal_blocks(codec_of(log), log.frames()):
                    files.write(block)
            if "cycles" in wanted:
                for block in cycle_blocks(log):
                    files.write(block)
        files.check()
        for path, rows in files.rows.items():
            click.echo(f"{path}: {rows} rows")
        if not files.rows:
            raise LogError(f"{', '.join(str(path) for path in logs)}: nothing of {', '.join(sorted(wanted))} in it")
        _say_others(out, set(files.rows))
        conclude(log)


def _signals(logs: tuple[Path, ...], out: Path, kind: str, start: TimeOption, end: TimeOption) -> None:
    from .integrity import conclude
    from .numeric import numeric_series
    from .numeric_files import open_numeric
    from .open_log import open_mcap
    from .tables import codec_of

    with open_mcap(logs, start, end) as log:
        try:
            with open_numeric(out, kind) as file:
                for series in numeric_series(log, codec_of(log)):
                    file.write(series)
        except FileExistsError as error:
            raise LogError(f"{out}: exists, and is not overwritten") from error
        except OSError as error:
            raise LogError(f"{out}: cannot be written ({error.strerror or error})") from error
        if not file.n:
            raise LogError(f"{', '.join(str(path) for path in logs)}: no number in it")
        file.check()
        for channel, n in sorted(file.n.items()):
            click.echo(f"{out}: {n} samples of {channel}")
        conclude(log)


def _say_others(out: Path, written: set[Path]) -> None:
    others = sorted(path.name for path in out.iterdir() if path not in written)
    if others:
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        click.echo(f"{out}: holds other files, left alone: {', '.join(others[:3])}{more}", err=True)
