"""`ema report`: one page about a flight."""

from __future__ import annotations

from pathlib import Path

import click

from ema.core import resources
from ema.core.errors import LogError

from .times import TimeOption, time_range

_PATH = click.Path(path_type=Path)


@click.command(short_help="One page about a flight: health, trends, alarms, remaining life.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=_PATH)
@click.option("--out", metavar="FILE", required=True, type=_PATH, help="HTML file to write; not overwritten.")
@click.option("--config", "config_path", metavar="FILE", type=_PATH, help="Thresholds (default: those shipped).")
@time_range
def report(logs: tuple[Path, ...], out: Path, config_path: Path | None, start: TimeOption, end: TimeOption) -> None:
    """Write a self-contained page: health of each actuator, trends, alarms, remaining life, data quality.

    It needs no network and prints on A4.

    \b
    Examples:
      ema report /var/log/ema --out flight.html
      ema report flight.mcap --out flight.html --config thresholds.yaml --start 60 --end 600
    """
    from ema.core import config

    from .open_log import open_mcap
    from .page import page
    from .report_settings import ReportSettings

    settings = config.load(config_path or resources.config("report.yaml"), ReportSettings)
    if out.exists():
        raise LogError(f"{out}: exists, and is not overwritten")
    with open_mcap(logs, start, end) as log:
        text = page(log, settings)
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise LogError(f"{out}: cannot be written ({error.strerror})") from error
    click.echo(f"{out}: {len(text) / 1e3:.0f} kB")
