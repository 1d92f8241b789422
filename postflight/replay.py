"""`ema replay`: a log back onto a bus, or through the identifiers again."""

from __future__ import annotations

import json
from collections.abc import Set
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ema.core.errors import LogError
from ema.core.ranges import FiniteRange

from .times import TimeOption, time_range

_PATH = click.Path(path_type=Path)
_WITH_ONTO = ("speed", "loop", "skip_gaps", "ids", "rename")
_WITH_IDENTIFY = ("bundle", "cycles", "out", "processes")


@click.command(short_help="A log back onto a bus, or through the identifiers again.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--onto", multiple=True, metavar="BUS",
    help="Send on this bus: vcan0, udp_multicast, auto …; CHANNEL=BUS for one channel of the log (repeatable).",
)  # fmt: skip
@click.option("--identify", is_flag=True, help="Estimate the faults again, and compare with the log's estimates.")
@click.option("--channel", multiple=True, metavar="NAME", help="Only this channel of the log (repeatable).")
@time_range
@click.option(
    "--speed", type=FiniteRange(0, min_open=True, infinite=True), default=1, help="With --onto. inf: no waiting."
)
@click.option("--loop", type=click.IntRange(min=0), default=1, help="With --onto. How often; 0: until stopped.")
@click.option("--skip-gaps", type=FiniteRange(min=0), metavar="S", help="With --onto. No silence is longer. [s]")
@click.option("--id", "ids", multiple=True, metavar="ID", help="With --onto. ID, ID-ID or ID:MASK, hex; ~ inverts.")
@click.option("--rename", multiple=True, metavar="ID=ID", help="With --onto. Send an identifier as another, hex.")
@click.option("--bundle", multiple=True, metavar="[N=]DIR", help="With --identify. Not the log's own (for actuator N).")
@click.option("--cycles", metavar="FILE", type=_PATH, help="With --identify. CSV of the comparison cycle by cycle.")
@click.option("--out", metavar="FILE", type=_PATH, help="With --identify. New MCAP log of the new estimates.")
@click.option("--processes", type=click.IntRange(1, 2), help="With --identify. Default: 2 for a long log.")
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
def replay(
    logs: tuple[Path, ...], onto: tuple[str, ...], identify: bool, start: TimeOption, end: TimeOption, **how: Any
) -> None:
    """Send the raw frames of a log on a bus, each at its own time, or identify the faults from them again.

    LOG is an MCAP file, a directory of segments (read as one), or a candump, asc, blf, csv, trc or mf4 log. With the
    bundle that the log was made with, the estimates are the same to the last bit (else exit status 1); with another
    bundle they are compared.

    \b
    Examples:
      ema replay flight.mcap --onto vcan0
      ema replay /var/log/ema --onto vcan0 --speed 4 --skip-gaps 1 --start 60 --end 120
      ema replay car.asc --onto 1=vcan0 --onto 2=vcan1 --id 100-1FF
      ema replay /var/log/ema --identify
      ema replay flight.mcap --identify --bundle new-bundle --cycles comparison.csv
    """
    from .open_log import open_log

    if bool(onto) == identify:
        raise click.UsageError("say what for: --onto BUS or --identify")
    _refuse_given(_WITH_ONTO if identify else _WITH_IDENTIFY, "--onto" if identify else "--identify")
    with open_log(logs, start, end) as log:
        if identify:
            from .reidentify import run

            run(log, how["bundle"], how["channel"], how["cycles"], how["out"], how["processes"], how["as_json"])
        else:
            _send(log, _selection(how["ids"], how["channel"], how["rename"]), onto, how)


def _refuse_given(names: tuple[str, ...], only_with: str) -> None:
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            option = next(p.opts[0] for p in context.command.params if p.name == name)
            raise click.UsageError(f"{option} has a meaning with {only_with} only")


def _send(log: Any, selection: Any, onto: tuple[str, ...], how: dict[str, Any]) -> None:
    import signal
    import threading

    from ema.bus.interface import open_bus, parse

    from .integrity import conclude
    from .onto import Replayer
    from .open_log import names
    from .pacing import Pace

    buses = _buses(onto)
    if odd := set(buses) - {""} - _channels(log, set(buses) - {""}):
        there = ", ".join(f"'{channel}'" for channel in sorted(_channels(log))) or "no frame at all"
        raise LogError(f"{names(log.paths)}: no frame of channel '{min(odd)}' in it (there is: {there})")
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    with ExitStack() as opened:
        ports = {}
        for channel, bus in buses.items():
            ports[channel] = opened.enter_context(open_bus(parse(bus)))
            click.echo(ports[channel].choice, err=True)
        longest = float("inf") if how["skip_gaps"] is None else how["skip_gaps"]
        replayer = Replayer(ports, Pace(how["speed"], longest), stop)
        rounds = 0
        while not stop.is_set() and (how["loop"] == 0 or rounds < how["loop"]):
            before = replayer.done.n_sent + replayer.done.n_refused
            replayer.run(selection.apply(log.frames()))
            rounds += 1
            if replayer.done.n_sent + replayer.done.n_refused == before:
                break
    done = replayer.done
    if done.n_sent + done.n_refused + done.n_unmapped == 0 and not stop.is_set():
        raise LogError(f"{names(log.paths)}: no frame in it is chosen")
    timed = done.n_sent > 0 and how["speed"] < float("inf")  # without waiting no frame has a time
    answer = {
        "sent": done.n_sent,
        "refused": done.n_refused,
        "unmapped": done.n_unmapped,
        "rounds": rounds,
        "duration": done.duration,
        "latest": done.latest if timed else None,
        "late_share_1ms": done.late_share(0.001) if timed else None,
    }
    if how["as_json"]:
        click.echo(json.dumps(answer, indent=2))
    else:
        _tell_sent(done, timed)
    if not stop.is_set():
        conclude(log)


def _tell_sent(done: Any, timed: bool) -> None:
    late = f"; {done.late_share(0.001):.2%} more than 1 ms late, the latest {done.latest * 1e3:.1f} ms" if timed else ""
    click.echo(f"{done.n_sent} frames sent in {done.duration:.1f} s{late}")
    if done.n_refused or done.n_unmapped:
        click.echo(f"{done.n_refused} refused by the bus, {done.n_unmapped} of channels without a bus")


def _buses(onto: tuple[str, ...]) -> dict[str, str]:
    """Buses by the log's channel, "" for all others."""
    buses: dict[str, str] = {}
    for text in onto:
        channel, _, bus = text.rpartition("=")
        if channel in buses:
            raise click.UsageError(f"--onto is given twice for {f'channel {channel!r}' if channel else 'all channels'}")
        buses[channel] = bus
    return buses


def _channels(log: Any, wanted: Set[str] | None = None) -> set[str]:
    """Channels of the log; only as many as it takes to have seen all that are `wanted`."""
    found: set[str] = set()
    for bus, _ in log.frames() if wanted != set() else ():
        found.add(bus)
        if wanted is not None and wanted <= found:
            break
    return found


def _selection(ids: tuple[str, ...], channels: tuple[str, ...], renames: tuple[str, ...]) -> Any:
    from .selection import IdFilter, Selection

    renamed = {}
    for text in renames:
        try:
            old, new = (int(part, 16) for part in text.split("="))
        except ValueError as error:
            raise click.BadParameter(f"{text!r} is not ID=ID in hexadecimal digits", param_hint="--rename") from error
        if not (0 <= old < 2**29 and 0 <= new < 2**29):
            raise click.BadParameter(f"{text!r}: an identifier has at most 29 bits", param_hint="--rename")
        if old in renamed:
            raise click.BadParameter(f"{old:X} is renamed twice", param_hint="--rename")
        renamed[old] = new
    return Selection(tuple(IdFilter.parse(text) for text in ids), channels, renamed)
