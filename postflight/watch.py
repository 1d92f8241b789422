"""`ema watch`: the bus in a terminal."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from .live import Live

_EVERY = 0.5  # the picture is renewed at 2 Hz [s]
_WIDTH = 16  # of a bar
_FULL = 0.3  # k of a full bar
_COLOURS = {"VALID": "green", "DEGRADED": "yellow", "INVALID": "red", "NOT_ESTIMATED": "bright_black"}


@click.command()
@click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
@click.option("--for", "seconds", type=click.FloatRange(min=0), metavar="S", help="End after so long. [s]")
def watch(bus: str, seconds: float | None) -> None:
    """Show each actuator's k with status, the daemon's heartbeat, losses and events, twice a second.

    It only listens. End with Ctrl-C. Where the output is no terminal, the last picture is printed once.

    \b
    Examples:
      ema watch --bus vcan0
      ssh onboard ema watch --bus vcan0 --for 10
    """
    import signal
    import threading

    from rich.console import Console
    from rich.live import Live as Screen

    from ema.bus import codec
    from ema.bus.interface import open_bus, parse

    from .live import Live

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    console, state = Console(), Live(codec.default())
    end = time.monotonic() + (float("inf") if seconds is None else seconds)
    with open_bus(parse(bus)) as port:
        picture = lambda: draw(state, port.choice, time.time_ns())  # noqa: E731
        if console.is_terminal:
            with Screen(picture(), console=console, screen=True, auto_refresh=False) as screen:
                while not stop.is_set() and time.monotonic() < end:
                    _listen(port, state, min(_EVERY, max(0.0, end - time.monotonic())))
                    screen.update(picture(), refresh=True)
        else:
            while not stop.is_set() and time.monotonic() < end:
                _listen(port, state, min(_EVERY, max(0.0, end - time.monotonic())))
        console.print(picture())


def _listen(port: Any, state: Live, seconds: float) -> None:
    """Read for so long."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        frames = port.read(min(left, 0.1))
        if frames.size:
            state.update(frames)
    state.look(time.time_ns())


def draw(state: Live, bus: str, now_ns: int) -> Any:
    """The picture, as something rich can print."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from ema.core.names import FAULTS

    table = Table(expand=True, box=None, pad_edge=False)
    for heading in ("actuator", "by", "cycle", "age", "status"):
        table.add_column(heading, no_wrap=True)
    for fault in FAULTS:
        table.add_column(fault, no_wrap=True)
    for (number, method), shown in sorted(state.estimates.items()):
        colour = _COLOURS[shown.status.name]
        bars = [_bar(k, sd, colour) for k, sd in zip(shown.k, shown.sd, strict=True)]
        age = f"{max(0.0, (now_ns - shown.t_ns) / 1e9):.0f} s"
        status = Text(shown.status.name.lower().replace("_", " "), colour)
        table.add_row(str(number), method, str(shown.cycle), age, status, *bars)
    silent = [n for n in state.cycles if not any(number == n for number, _ in state.estimates)]
    for number in sorted(silent):
        table.add_row(str(number), "–", str(state.cycles[number]), "", Text("not estimated", "bright_black"))
    lines: list[Any] = [Text(bus, "bold"), Text(""), table, Text("")]
    if not state.estimates and not state.cycles:
        lines.append(Text("nothing heard of an actuator yet", "bright_black"))
    lines += [_beat(state), Text("")]
    lines += [Text(f"{time.strftime('%H:%M:%S', time.localtime(t // 10**9))}  {text}") for t, text in state.events]
    return Group(*lines)


def _bar(k: float, sd: float, colour: str) -> Any:
    """A bar for k, lighter for one standard deviation above it, and the number."""
    from rich.text import Text

    length, beyond = (min(_WIDTH, round(_WIDTH * value / _FULL)) for value in (k, k + sd))
    bar = Text("█" * length, colour)
    bar.append("░" * (beyond - length), colour)
    bar.append("·" * (_WIDTH - beyond), "bright_black")
    bar.append(f"\n{k:.3f} ±{sd:.3f}")
    return bar


def _beat(state: Live) -> Any:
    from rich.text import Text

    from ema.core.status import LogState, ServiceState

    if not state.heartbeat:
        return Text("no heartbeat heard yet", "bright_black")
    b = state.heartbeat
    words = ServiceState(b["state"]).name.lower(), LogState(b["log_state"]).name.lower()
    if state.silent:
        return Text(f"daemon silent; last heard {words[0]}, up {b['uptime']} s", "red")
    text = Text(f"daemon {words[0]}", "green" if words[0] == "running" else "yellow")
    text.append(
        f", up {b['uptime']} s · log {words[1]}, {b['log_free']} MiB free · cycles {b['n_cycles']}, estimates "
        f"{b['n_estimates']} · lost {b['n_lost']}, CRC {b['n_crc_error']}, repeated {b['n_repeated']}, late "
        f"{b['n_reordered']}, kernel drops {b['kernel_drops']} · {state.n_frames} frames here, {state.n_bad} bad",
        "default",
    )
    return text
