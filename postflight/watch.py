"""`ema watch`: the bus in a terminal."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click

from ema.core.ranges import FiniteRange

if TYPE_CHECKING:
    from .live import Live, Shown

_EVERY = 0.5  # the picture is renewed at 2 Hz [s]
_LONGEST = 16  # of a bar
_WIDE = 150  # columns from which an estimate is one row with bars
_FULL = 0.3  # k of a full bar
_COLOURS = {"VALID": "green", "DEGRADED": "yellow", "INVALID": "red", "NOT_ESTIMATED": "bright_black"}


@click.command(short_help="The bus in a terminal: faults, heartbeat, losses, events.")
@click.option("--bus", default="auto", show_default=True, metavar="BUS", help="auto, vcan0, udp_multicast …")
@click.option("--for", "seconds", type=FiniteRange(min=0), metavar="S", help="End after so long. [s]")
def watch(bus: str, seconds: float | None) -> None:
    """Show each actuator's k with status, the daemon's heartbeat, losses and events, twice a second.

    It only listens. End with Ctrl-C. Where the output is no terminal, or one that cannot move its cursor, the last
    picture is printed once. What does not fit the window is shown shorter: bars below, then numbers only.

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
        picture = lambda: draw(state, port.choice, time.time_ns(), *console.size)  # noqa: E731
        if console.is_terminal and not console.is_dumb_terminal:
            with Screen(picture(), console=console, screen=True, auto_refresh=False) as screen:
                while not stop.is_set() and time.monotonic() < end:
                    _listen(port, state, min(_EVERY, max(0.0, end - time.monotonic())))
                    screen.update(picture(), refresh=True)
        else:
            when = "Ctrl-C" if seconds is None else f"{seconds:g} s"
            click.echo(f"no terminal to draw on: one picture after {when}", err=True)
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


def draw(state: Live, bus: str, now_ns: int, width: int, height: int) -> Any:
    """The picture for a window of so many columns and lines, as something rich can print."""
    from rich.console import Group
    from rich.text import Text

    lines: list[Any] = [Text(bus, "bold"), _beat(state), Text("")]
    beside = [
        f"actuator {n}, {by}: {one.name} = {one.value:.4g} ± {one.sd:.2g} (95 %: {one.low:.4g} … {one.high:.4g})"
        for (n, by, _), one in sorted(state.beside.items())
    ]
    if state.estimates:
        room = height - len(lines) - len(beside) - -(-len(_words(state)) // width) - 2
        if width >= _WIDE and 2 * len(state.estimates) < room:
            lines.append(_rows(state, now_ns, _LONGEST))
        elif 3 * len(state.estimates) < room and width >= 60:
            lines += _blocks(state, now_ns, min(_LONGEST, width // 6 - 2))
        else:
            lines.append(_rows(state, now_ns, 0))
    silent = sorted(n for n in state.cycles if not any(number == n for number, _ in state.estimates))
    lines += [Text(f"actuator {n}: cycle {state.cycles[n]}, not estimated", "bright_black") for n in silent]
    if not state.estimates and not state.cycles:
        lines.append(Text("nothing heard of an actuator yet", "bright_black"))
    lines.append(Text(""))
    if beside:
        lines += [Text("beside the faults", "bold"), *(Text(text) for text in beside), Text("")]
    lines += [Text(f"{time.strftime('%H:%M:%S', time.localtime(t // 10**9))}  {text}") for t, text in state.events]
    return Group(*lines)


def _rows(state: Live, now_ns: int, longest: int) -> Any:
    """A table with a row for each estimate; bars only where `longest` is not 0."""
    from rich.table import Table

    from ema.core.names import FAULTS

    table = Table(expand=longest > 0, box=None, pad_edge=False, padding=(0, 2 if longest else 1, 0, 0))
    for heading in ("actuator" if longest else "act", "by", "cycle", "age", "status", *FAULTS):
        table.add_column(heading, no_wrap=True)
    for (number, method), shown in sorted(state.estimates.items()):
        who = str(number), method, str(shown.cycle), _age(shown, now_ns), _status(shown)
        cells = [
            _bar(k, sd, _COLOURS[shown.status.name], longest) if longest else f"{k:.3f}"
            for k, sd in zip(shown.k, shown.sd, strict=True)
        ]
        table.add_row(*who, *cells)
    return table


def _blocks(state: Live, now_ns: int, longest: int) -> list[Any]:
    """A line of words and two of bars and numbers for each estimate."""
    from rich.table import Table
    from rich.text import Text

    blocks: list[Any] = []
    for (number, method), shown in sorted(state.estimates.items()):
        head = Text(f"actuator {number}  {method}  cycle {shown.cycle}  {_age(shown, now_ns)} ago  ", "bold")
        table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
        table.add_row(
            *(_bar(*pair, _COLOURS[shown.status.name], longest) for pair in zip(shown.k, shown.sd, strict=True))
        )
        blocks += [head.append(_status(shown)), table]
    return blocks


def _age(shown: Shown, now_ns: int) -> str:
    return f"{max(0.0, (now_ns - shown.t_ns) / 1e9):.0f} s"


def _status(shown: Shown) -> Any:
    from rich.text import Text

    return Text(shown.status.name.lower().replace("_", " "), _COLOURS[shown.status.name])


def _bar(k: float, sd: float, colour: str, longest: int) -> Any:
    """A bar for k, lighter for one standard deviation above it, and the numbers below."""
    from rich.text import Text

    length, beyond = (min(longest, round(longest * value / _FULL)) for value in (k, k + sd))
    bar = Text("█" * length, colour)
    bar.append("░" * (beyond - length), colour)
    bar.append("·" * (longest - beyond), "bright_black")
    numbers = f"{k:.3f} ±{sd:.3f}"
    bar.append(f"\n{numbers if len(numbers) <= longest else numbers.replace('±0', '±')}"[: longest + 1])
    return bar


def _beat(state: Live) -> Any:
    from rich.text import Text

    from ema.core.status import ServiceState

    if not state.heartbeat:
        return Text(_words(state), "bright_black")
    running = state.heartbeat["state"] == ServiceState.RUNNING
    return Text(_words(state), "red" if state.silent else "green" if running else "yellow")


def _words(state: Live) -> str:
    """The heartbeat in words."""
    from ema.core.status import LogState, ServiceState

    if not state.heartbeat:
        return "no heartbeat heard yet"
    b = state.heartbeat
    words = ServiceState(b["state"]).name.lower(), LogState(b["log_state"]).name.lower()
    if state.silent:
        return f"daemon silent; last heard {words[0]}, up {b['uptime']} s"
    return (
        f"daemon {words[0]}, up {b['uptime']} s · log {words[1]}, {b['log_free']} MiB free · cycles {b['n_cycles']}, "
        f"estimates {b['n_estimates']} · lost {b['n_lost']}, CRC {b['n_crc_error']}, repeated {b['n_repeated']}, late "
        f"{b['n_reordered']}, kernel drops {b['kernel_drops']} · {state.n_frames} frames here, {state.n_bad} bad"
    )
