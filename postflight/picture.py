"""The picture of `ema watch`, for a window of any size from 80 by 24.

Nothing is said by colour alone: states are words, levels have marks, and a legend says what signs and colours mean.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from ema.core.names import FAULTS
from ema.core.status import AlarmLevel, AlarmState

from .view import KEYS, View

if TYPE_CHECKING:
    from ema.alarms import Change

    from .live import Live, Shown

_WIDE = 150  # columns from which numbers have their standard deviation on one line
_FULL = 0.3  # k of a full bar
_LONGEST, _SHORTEST = 16, 4  # of a bar
_COLOURS = {"VALID": "green", "DEGRADED": "yellow", "INVALID": "red", "NOT_ESTIMATED": "bright_black"}
_LEVELS = {AlarmLevel.NONE: ("  ", ""), AlarmLevel.WATCH: ("! ", "yellow"), AlarmLevel.ALARM: ("!!", "red")}
_WORDS = 41  # columns of who, when and how
_NARROW = 80  # columns below which ages are left out
_LEGEND = "valid green; degraded, ! watch yellow; invalid, !! alarm red; bar █ k ░ +sd"


def draw(state: Live, bus: str, now_ns: int, width: int, height: int, view: View | None = None) -> Any:
    """Something that rich can print, of at most so many columns and lines."""
    from rich.console import Group
    from rich.text import Text

    view = view or View()
    alarms = state.alarms.known(now_ns)
    head = [
        _title(bus, view, now_ns, width),
        *_beat(state, width),
        *_alarms(state, alarms, view, width, height),
    ]
    foot = [_cut(line, width, "bright_black") for line in (_LEGEND, KEYS)]
    shown = {key: one for key, one in sorted(state.estimates.items()) if view.shows(key[0], alarms)}
    body: list[Any] = []
    room = height - len(head) - len(foot)
    if shown:
        lines = 2 if 2 * len(shown) + 1 <= room - 2 else 1
        fit = max(1, (room - 1) // lines - (len(shown) * lines + 1 > room))
        body.append(_table(dict(list(shown.items())[:fit]), now_ns, width, lines, alarms))
        room -= 1 + lines * min(fit, len(shown))
        if len(shown) > fit:
            body.append(_cut(f"… {len(shown) - fit} more estimates: f filters", width, "bold"))
            room -= 1
    more = [*_unheard(state), *_beside(state), *_events(state)]
    body += [_cut(line, width) for line in more[: max(0, room)]]
    return Group(*head, *body, *foot) if body else Group(*head, Text(""), *foot)


def _title(bus: str, view: View, now_ns: int, width: int) -> Any:
    clock = time.strftime("%H:%M:%S", time.localtime(now_ns // 10**9))
    marks = [f"frozen {clock}" if view.frozen else clock]
    if view.only is not None:
        marks.append("only alarms" if view.only == "alarms" else f"only actuator {view.only}")
    return _cut(f"{' · '.join(marks)} · {bus}", width, "bold reverse" if view.frozen else "bold")


def _cut(text: str, width: int, style: str = "") -> Any:
    """One line; what does not fit ends with a mark."""
    from rich.text import Text

    return Text(text if len(text) <= width else text[: width - 1] + "›", style, no_wrap=True)


def _alarms(state: Live, alarms: list[Change], view: View, width: int, height: int) -> list[Any]:
    if not state.alarms.heard_ns:
        return [_cut("alarms: none told of yet", width, "bright_black")]
    if not alarms:
        return [_cut("alarms: none", width, "green")]
    room = max(2, height // 4)
    choice = view.choice(alarms)
    at = alarms.index(choice) if choice is not None else 0
    first = max(0, min(at - room + 1, len(alarms) - room))
    n_new = sum(change.state == AlarmState.ACTIVE for change in alarms)
    lines = [_cut(f"alarms: {len(alarms)}, {n_new} not acknowledged", width, "bold")]
    for change in alarms[first : first + room]:
        mark, style = _LEVELS[change.level]
        pointer = "›" if change is choice else " "
        lines.append(_cut(f"{pointer}{mark} {_alarm_words(change)}", width, style))
    return lines


def _alarm_words(change: Change) -> str:
    from ema.alarms import CAUSES
    from ema.alarms.change import measured

    whose = "monitor" if change.actuator is None else str(change.actuator)
    level, words = change.level.name.lower(), change.state.name.lower().replace("_", "-")
    cause = CAUSES[change.cause]
    return f"{whose}.{change.cause} {level}, {words}: {measured(cause, change.measure) or cause.meaning}"


def _table(shown: dict[tuple[int, str], Shown], now_ns: int, width: int, lines: int, alarms: list[Change]) -> Any:
    """A row for each estimate under the names of its columns; with bars where there are two lines."""
    from rich.table import Table
    from rich.text import Text

    column = min(_LONGEST, (width - _WORDS) // len(FAULTS) - 1)
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    ages = ["age"] if width >= _NARROW else []
    for heading in ("act", "by", "cycle", *ages, "status", *FAULTS):
        table.add_column(heading, no_wrap=True)
    levels = {(change.actuator, change.cause): change.level for change in alarms}
    for (number, method), one in shown.items():
        who = [str(number), method, str(one.cycle), *([_age(one, now_ns)] if ages else []), _status(one)]
        cells = []
        for fault, k, sd in zip(FAULTS, one.k, one.sd, strict=True):
            mark, style = _LEVELS[levels.get((number, fault), AlarmLevel.NONE)]
            numbers = f"{k:.3f}{f' ±{sd:.3f}' if width >= _WIDE else ''}{mark}".rstrip()
            cell = Text(numbers, style)
            if lines == 2 and column >= _SHORTEST:
                cell.append("\n").append(_bar(float(k), float(sd), _COLOURS[one.status.name], column))
            cells.append(cell)
        table.add_row(*who, *cells)
    return table


def _unheard(state: Live) -> list[str]:
    if not state.estimates and not state.cycles:
        return ["nothing heard of an actuator yet"]
    silent = sorted(n for n in state.cycles if not any(number == n for number, _ in state.estimates))
    return [f"actuator {n}: cycle {state.cycles[n]}, not estimated" for n in silent]


def _beside(state: Live) -> list[str]:
    lines = [
        f"actuator {n}, {by}: {one.name} = {one.value:.4g} ± {one.sd:.2g} (95 %: {one.low:.4g} … {one.high:.4g})"
        for (n, by, _), one in sorted(state.beside.items())
    ]
    return ["beside the faults:", *lines] if lines else []


def _events(state: Live) -> list[str]:
    told = reversed(state.events)  # the latest first
    return [f"{time.strftime('%H:%M:%S', time.localtime(t // 10**9))}  {text}" for t, text in told]


def _age(shown: Shown, now_ns: int) -> str:
    return f"{max(0.0, (now_ns - shown.t_ns) / 1e9):.0f} s"


def _status(shown: Shown) -> Any:
    from rich.text import Text

    return Text(shown.status.name.lower().replace("_", " "), _COLOURS[shown.status.name])


def _bar(k: float, sd: float, colour: str, longest: int) -> Any:
    """A bar for k, lighter for one standard deviation above it."""
    from rich.text import Text

    length, beyond = (min(longest, round(longest * value / _FULL)) for value in (k, k + sd))
    bar = Text("█" * length, colour)
    bar.append("░" * (beyond - length), colour)
    bar.append("·" * (longest - beyond), "bright_black")
    return bar


def _beat(state: Live, width: int) -> list[Any]:
    """The heartbeat in words, in as many lines as it takes."""
    from rich.text import Text

    from ema.core.status import ServiceState

    words = _words(state)
    if not state.heartbeat:
        style = "bright_black"
    else:
        running = state.heartbeat["state"] == ServiceState.RUNNING
        style = "red" if state.silent else "green" if running else "yellow"
    lines: list[str] = [""]
    for part in words.split(" · "):
        joined = f"{lines[-1]} · {part}" if lines[-1] else part
        if len(joined) <= width:
            lines[-1] = joined
        else:
            lines.append(part)
    return [Text(line, style) for line in lines]


def _why(state: Live) -> str:
    """What the heartbeat names as the reason of its state."""
    reason, concerned = state.heartbeat.get("reason", 0), state.heartbeat.get("concerned", 255)
    if not reason:
        return ""
    names = state.codec.messages["Heartbeat"].fields["reason"].names
    whose = f" of actuator {concerned}" if concerned < 64 else ""
    return f" ({names.get(reason, '?').replace('_', ' ')}{whose})"


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
        f"daemon {words[0]}{_why(state)}, up {b['uptime']} s · log {words[1]}, {b['log_free']} MiB free · "
        f"cycles {b['n_cycles']}, estimates {b['n_estimates']} · lost {b['n_lost']}, CRC {b['n_crc_error']}, "
        f"repeated {b['n_repeated']}, late {b['n_reordered']}, kernel drops {b['kernel_drops']} · "
        f"{state.n_frames} frames here, {state.n_bad} bad"
    )
