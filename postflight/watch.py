"""`ema watch`: the bus in a terminal."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ema.core.ranges import FiniteRange

if TYPE_CHECKING:
    import threading

    from .live import Live

_EVERY = 0.5  # the picture is renewed at 2 Hz, and at once for a key [s]
_LOOKS = 0.1  # for keys [s]


@click.command(short_help="The bus in a terminal: alarms, faults, heartbeat, losses, events.")
@click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
@click.option("--for", "seconds", type=FiniteRange(min=0), metavar="S", help="End after so long. [s]")
@click.option("--key-file", type=click.Path(path_type=Path), help="Of a bus whose frames are authenticated.")
@click.option(
    "--foxglove",
    metavar="[PORT]",
    type=click.IntRange(0, 65535),
    is_flag=False,
    flag_value=8765,
    help="Serve the bus to Foxglove on this port of the loopback instead  [8765]",
)
def watch(bus: str, seconds: float | None, key_file: Path | None, foxglove: int | None) -> None:
    """Show alarms, each actuator's k with status, the daemon's heartbeat, losses and events, twice a second.

    Keys: j and k choose an alarm, a acknowledges it (the one thing that is ever sent), f filters, space freezes the
    picture, q or Ctrl-C ends. Where the output is no terminal, or one that cannot move its cursor, the last picture is
    printed once. What does not fit the window is shown shorter: without bars, then numbers only.

    \b
    Examples:
      ema watch --bus vcan0
      ssh onboard ema watch --bus vcan0 --for 10
      ema watch --bus vcan0 --foxglove
    """
    import signal
    import threading

    from rich.console import Console
    from rich.live import Live as Screen

    from ema.bus import codec
    from ema.bus.commanding import Commander
    from ema.bus.interface import open_bus, parse

    from .keyboard import Keyboard
    from .live import Live
    from .picture import draw
    from .view import View

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    console, state, view = Console(), Live(codec.default()), View()
    end = time.monotonic() + (float("inf") if seconds is None else seconds)
    chosen = parse(bus).model_copy(update={"key_file": key_file})
    if foxglove is not None:
        _serve(chosen, foxglove, end, stop)
        return
    with open_bus(chosen) as port:
        commander = Commander(port, codec.default())
        picture = lambda: draw(state, port.choice, time.time_ns(), *console.size, view)  # noqa: E731
        if console.is_terminal and not console.is_dumb_terminal:
            with Keyboard() as keys, Screen(picture(), console=console, screen=True, auto_refresh=False) as screen:
                while not (stop.is_set() or view.quitting) and time.monotonic() < end:
                    until = min(end, time.monotonic() + _EVERY)
                    pressed = ""
                    while not pressed and not stop.is_set() and (left := until - time.monotonic()) > 0:
                        _listen(port, state, min(_LOOKS, left))
                        pressed = keys.pressed()
                    _act(pressed, view, state, commander)
                    if not view.frozen or pressed:
                        screen.update(picture(), refresh=True)
        else:
            when = "Ctrl-C" if seconds is None else f"{seconds:g} s"
            click.echo(f"no terminal to draw on: one picture after {when}", err=True)
            while not stop.is_set() and time.monotonic() < end:
                _listen(port, state, min(_EVERY, max(0.0, end - time.monotonic())))
        console.print(picture())


def _act(pressed: str, view: Any, state: Live, commander: Any) -> None:
    """Do what keys ask."""
    from ema.alarms import Action
    from ema.alarms.bus import COMMAND, command_values

    for key in pressed:
        change = view.press(key, state.alarms.known(time.time_ns()), state.actuators)
        if change is not None:
            values = command_values(Action.ACK, change.cause, 0.0, state.codec)
            commander.send(COMMAND, change.actuator or 0, values)


def _serve(chosen: Any, number: int, end: float, stop: threading.Event) -> None:
    """The bus to every Foxglove that connects, until `end` or `stop`."""
    from ema.bus import codec
    from ema.bus.interface import open_bus

    from .foxglove import FoxgloveServer

    with open_bus(chosen) as port, FoxgloveServer(codec.default(), "127.0.0.1", number) as server:
        click.echo(f"{port.choice}; in Foxglove open a connection to {server.url}")
        while not stop.is_set() and time.monotonic() < end:
            server.update(port.name, port.read(min(_EVERY, max(0.0, end - time.monotonic()))))


def _listen(port: Any, state: Live, seconds: float) -> None:
    """Read for so long."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        frames = port.read(min(left, 0.1))
        if frames.size:
            state.update(frames)
    state.look(time.time_ns())
