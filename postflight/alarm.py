"""`ema alarm`: what stands on the bus, and what an operator does about it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ema.core.errors import NegativeAnswer
from ema.core.ranges import FiniteRange

if TYPE_CHECKING:
    from ema.alarms import Action, Change
    from ema.alarms.bus import AlarmListener
    from ema.bus.port import Port

_LISTENS = 2.5  # alarms are repeated with each heartbeat [s]
_ANSWERS_WITHIN = 4.0  # a command is done at once, for supervision with the heartbeat a second later [s]
_MONITOR = "monitor"
_bus = click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
_key = click.option("--key-file", type=click.Path(path_type=Path), help="Of a bus whose frames are authenticated.")
_names = click.argument("names", metavar="NAME...", nargs=-1, required=True)


@click.group(short_help="Alarms on the bus: list, acknowledge, clear, shelve.")
def alarm() -> None:
    """What stands, and what an operator does about it; NAME is as listed: 0.k3, monitor.log; "all" is all that stand.

    The words are those of ISA-18.2, see docs/alarms.md. Exit status 1 if no monitor is heard, or an alarm does not go
    where it should.

    \b
    Examples:
      ema alarm list --bus vcan0
      ema alarm ack 0.k3 --bus vcan0
      ema alarm shelve 0.k3_rate --for 2 --bus vcan0
    """


@alarm.command("list")
@_bus
@_key
@click.option("--json", "as_json", is_flag=True, help="Answer for a machine.")
def list_alarms(bus: str, key_file: Path | None, as_json: bool) -> None:
    """Listen for two heartbeats, and show every alarm that is not inactive, the most urgent first.

    \b
    Example:
      ema alarm list --bus vcan0
    """
    with _opened(bus, key_file) as port:
        known = _heard(port).known(time.time_ns())
    if as_json:
        from ema.alarms.change import said
        from ema.log import contents
        from ema.log.schemas import to_json

        click.echo(json.dumps([json.loads(to_json(contents.alarm(c, said(c)))) for c in known], indent=2))
    else:
        for change in known:
            click.echo(_line(change))
        if not known:
            click.echo("no alarm")


@alarm.command()
@_names
@_bus
@_key
def ack(names: tuple[str, ...], bus: str, key_file: Path | None) -> None:
    """Say that alarms have been seen.

    \b
    Example:
      ema alarm ack 0.k3 monitor.log --bus vcan0
    """
    from ema.alarms import Action
    from ema.core.status import AlarmState

    _do(Action.ACK, names, bus, key_file, lambda state: state != AlarmState.ACTIVE, "is not taken as seen")


@alarm.command()
@_names
@_bus
@_key
def clear(names: tuple[str, ...], bus: str, key_file: Path | None) -> None:
    """Give up alarms whose condition has gone.

    \b
    Example:
      ema alarm clear 0.k3 --bus vcan0
    """
    from ema.alarms import Action
    from ema.core.status import AlarmState

    _do(Action.CLEAR, names, bus, key_file, lambda s: s == AlarmState.INACTIVE, "is not cleared: its condition holds")


@alarm.command()
@_names
@_bus
@_key
@click.option("--for", "hours", type=FiniteRange(1 / 60, 1000), default=1.0, show_default=True, help="Hours.")
def shelve(names: tuple[str, ...], bus: str, key_file: Path | None, hours: float) -> None:
    """Take alarms out of sight for a while; at most as long as the monitor's alarms.yaml allows.

    \b
    Example:
      ema alarm shelve 0.k3_rate --for 2 --bus vcan0
    """
    from ema.alarms import Action
    from ema.core.status import AlarmState

    seconds = hours * 3600.0
    _do(Action.SHELVE, names, bus, key_file, lambda s: s == AlarmState.SHELVED, "is not shelved", seconds)


@alarm.command()
@_names
@_bus
@_key
def unshelve(names: tuple[str, ...], bus: str, key_file: Path | None) -> None:
    """Bring shelved alarms back before their time.

    \b
    Example:
      ema alarm unshelve 0.k3_rate --bus vcan0
    """
    from ema.alarms import Action
    from ema.core.status import AlarmState

    _do(Action.UNSHELVE, names, bus, key_file, lambda s: s != AlarmState.SHELVED, "is still shelved")


def _do(
    action: Action,
    names: tuple[str, ...],
    bus: str,
    key_file: Path | None,
    done: Callable[[Any], bool],
    failed: str,
    duration: float = 0.0,
) -> None:
    from ema.alarms.bus import COMMAND, command_values
    from ema.bus import codec
    from ema.bus.commanding import Commander
    from ema.core.status import AlarmState

    named = [] if names == ("all",) else [_parse(name) for name in names]
    with _opened(bus, key_file) as port:
        listener = _heard(port)
        wanted = named or [(c.actuator, c.cause) for c in listener.known(time.time_ns())]
        commander = Commander(port, codec.default())
        for actuator, cause in wanted:
            commander.send(COMMAND, actuator or 0, command_values(action, cause, duration, codec.default()))
        # what is latched-cleared may go by this, or stay: that is awaited, and both is well
        settled = lambda state: done(state) and state != AlarmState.LATCHED_CLEARED  # noqa: E731
        _listen(port, listener, _ANSWERS_WITHIN, lambda: all(settled(_state(listener, key)) for key in wanted))
        stuck = [key for key in wanted if not done(_state(listener, key))]
    for key in wanted:
        change = listener.find(*key)
        click.echo(_line(change) if change else f"{_name(*key)}  inactive")
    if stuck:
        raise NegativeAnswer(f"{', '.join(_name(*key) for key in stuck)} {failed}")


def _opened(bus: str, key_file: Path | None) -> Port:
    from ema.bus import codec
    from ema.bus.interface import open_bus, parse

    filters = codec.default().filters("Monitor")
    return open_bus(parse(bus).model_copy(update={"key_file": key_file}), filters)


def _heard(port: Port) -> AlarmListener:
    """What is heard within two heartbeats; NegativeAnswer where there is no monitor."""
    from ema.alarms.bus import AlarmListener
    from ema.bus import codec

    listener = AlarmListener(codec.default())
    _listen(port, listener, _LISTENS, lambda: False)
    if not listener.heard_ns:
        raise NegativeAnswer(f"no monitor tells of alarms on bus {port.name} (ema doctor --bus … looks at the bus)")
    return listener


def _listen(port: Port, listener: AlarmListener, seconds: float, enough: Callable[[], bool]) -> None:
    end = time.monotonic() + seconds
    while not enough() and (left := end - time.monotonic()) > 0:
        listener.update(port.read(min(left, 0.1)))


def _state(listener: AlarmListener, key: tuple[int | None, str]) -> Any:
    from ema.core.status import AlarmState

    change = listener.find(*key)
    return AlarmState.INACTIVE if change is None else change.state


def _parse(name: str) -> tuple[int | None, str]:
    from ema.alarms import CAUSES
    from ema.alarms.causes import OF_MONITOR

    whose, _, cause = name.partition(".")
    if cause not in CAUSES:
        raise click.BadParameter(f"'{name}': the causes are {', '.join(CAUSES)}", param_hint="NAME")
    is_monitors = CAUSES[cause] in OF_MONITOR
    if is_monitors != (whose == _MONITOR) or not (is_monitors or (whose.isdecimal() and int(whose) < 64)):
        right = f"{_MONITOR}.{cause}" if is_monitors else f"0.{cause} … 63.{cause}"
        raise click.BadParameter(f"'{name}': must be {right}", param_hint="NAME")
    return None if is_monitors else int(whose), cause


def _name(actuator: int | None, cause: str) -> str:
    return f"{_MONITOR if actuator is None else actuator}.{cause}"


def _line(change: Change) -> str:
    from ema.alarms import CAUSES
    from ema.alarms.change import measured

    cause = CAUSES[change.cause]
    state = change.state.name.lower().replace("_", "-")
    since = time.strftime("%H:%M:%S", time.localtime(change.since_ns / 1e9)) if change.since_ns else ""
    text = "; ".join(part for part in (cause.meaning, measured(cause, change.measure)) if part)
    level = change.level.name.lower() if change.level else ""
    return f"{_name(change.actuator, change.cause):<18} {level:<6} {state:<16} {since:<9} {text}"
