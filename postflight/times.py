"""Times on the command line: seconds from the beginning of a log, or a moment in ISO 8601."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import click

TimeOption = Callable[[int], int] | None
_SECONDS, _MOMENT = "seconds from the log's beginning", "a time like 2025-03-14T09:15:00Z"


class TimeParameter(click.ParamType):
    """Either seconds after the log's first frame or message, or a moment; becomes a function of the first time [ns]."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Callable[[int], int]:
        """See click."""
        if callable(value):
            return value
        try:
            ns = round(float(value) * 1e9)  # neither NaN nor infinite
            return lambda first_ns: first_ns + ns
        except (ValueError, OverflowError):
            pass
        try:
            moment = datetime.fromisoformat(value)
            moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            t_ns = round(moment.timestamp() * 1e6) * 1000
        except (ValueError, OverflowError):
            self.fail(f"{value!r} is neither {_SECONDS} nor {_MOMENT}")
        return lambda first_ns: t_ns


def time_range(command: Any) -> Any:
    """Options --start and --end."""
    kind = TimeParameter()
    end = click.option("--end", type=kind, metavar="T", help="Leave out what is later (likewise).")
    start = click.option(
        "--start", type=kind, metavar="T", help=f"Leave out what is earlier ({_SECONDS}, or {_MOMENT})."
    )
    return start(end(command))


def limits(first_ns: int, start: TimeOption, end: TimeOption) -> tuple[int | None, int | None]:
    """Start and end of what is wanted of a log [ns], by its first time."""
    start_ns, end_ns = (None if t is None else t(first_ns) for t in (start, end))
    if start_ns is not None and end_ns is not None and start_ns >= end_ns:
        raise click.UsageError(f"--start must be before --end, and is {(start_ns - end_ns) / 1e9:g} s after it")
    return start_ns, end_ns


def iso(t_ns: int) -> str:
    """A time for people, UTC to the millisecond."""
    moment = datetime.fromtimestamp(t_ns // 1_000_000_000, UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}.{t_ns // 1_000_000 % 1000:03d}Z"
