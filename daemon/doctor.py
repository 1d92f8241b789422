"""`ema doctor`."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import click


@click.command(short_help="What this machine has for the monitor, and what to do about what is missing.")
@click.option("--config", "config_path", metavar="FILE", type=click.Path(path_type=Path), help="The daemon's.")
@click.option("--bus", metavar="BUS", help="Try this bus: auto, vcan0, udp_multicast …  [default: the configuration's]")
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
def doctor(config_path: Path | None, bus: str | None, as_json: bool) -> None:
    """Look at kernel CAN, buffers, bus, clock, machine, and, with --config, at bundles and the log's disk.

    Nothing is changed. Exit status 1 if the monitor would not work.

    \b
    Examples:
      ema doctor
      ema doctor --config /etc/ema/vcan0.yaml
    """
    from ema.bus.interface import parse
    from ema.core.errors import ConfigError, NegativeAnswer

    from .checkup import Verdict, checkup
    from .settings import load

    chosen = parse(bus) if bus else None
    if chosen is None and config_path is not None:
        with suppress(ConfigError):  # told by the checkup
            chosen = load(config_path).bus
    findings = list(checkup(config_path, chosen))
    if as_json:
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=2, ensure_ascii=False))
    else:
        for finding in findings:
            click.echo(f"{finding.verdict:<8} {finding.what}: {finding.found}")
            if finding.remedy:
                click.echo(f"{'':<8}   → {finding.remedy}")
    bad = [finding.what for finding in findings if finding.verdict is Verdict.BAD]
    if bad:
        raise NegativeAnswer(f"the monitor would not work here: {', '.join(bad)}")
