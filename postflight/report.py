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
@click.option("--config", "config_path", metavar="FILE", type=_PATH, help="What is shown (default: as shipped).")
@click.option("--alarms", "alarms_path", metavar="FILE", type=_PATH, help="Thresholds (default: the daemon's).")
@time_range
def report(
    logs: tuple[Path, ...],
    out: Path,
    config_path: Path | None,
    alarms_path: Path | None,
    start: TimeOption,
    end: TimeOption,
) -> None:
    """Write a self-contained page: health of each actuator, trends, alarms, remaining life, data quality.

    It needs no network and prints on A4.

    \b
    Examples:
      ema report /var/log/ema --out flight.html
      ema report flight.mcap --out flight.html --alarms alarms.yaml --start 60 --end 600
    """
    from ema.alarms import AlarmSettings
    from ema.core import config

    from .integrity import conclude
    from .open_log import open_mcap
    from .page import page
    from .report_settings import ReportSettings, of_log, shipped

    settings = config.load(config_path or resources.config("report.yaml"), ReportSettings)
    if out.exists():
        raise LogError(f"{out}: exists, and is not overwritten")
    chosen = config.load(alarms_path, AlarmSettings) if alarms_path else None
    with open_mcap(logs, start, end) as log:
        settings = settings.model_copy(update={"alarms": chosen or of_log(log.attachments()) or shipped()})
        text = page(log, settings)
        try:
            out.write_text(text, encoding="utf-8")
        except OSError as error:
            raise LogError(f"{out}: cannot be written ({error.strerror})") from error
        click.echo(f"{out}: {len(text) / 1e3:.0f} kB")
        conclude(log)
