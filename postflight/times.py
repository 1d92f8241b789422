"""Times on the command line: seconds from the beginning of a log, or a moment in ISO 8601."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import click

TimeOption = Callable[[int], int] | None


class TimeParameter(click.ParamType):
    """Either seconds after the log's first frame or message, or a moment; becomes a function of the first time [ns]."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Callable[[int], int]:
        """See click."""
        if callable(value):
            return value
        try:
            seconds = float(value)
            return lambda first_ns: first_ns + round(seconds * 1e9)
        except (ValueError, OverflowError):
            pass
        try:
            moment = datetime.fromisoformat(value)
            moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            t_ns = round(moment.timestamp() * 1e6) * 1000
        except (ValueError, OverflowError):
            self.fail(f"{value!r} is neither seconds from the log's beginning nor a time like 2025-03-14T09:15:00Z")
        return lambda first_ns: t_ns


def time_range(command: Any) -> Any:
    """Options --start and --end."""
    kind = TimeParameter()
    help_text = "seconds from the log's beginning, or a time like 2025-03-14T09:15:00Z"
    end = click.option("--end", type=kind, metavar="T", help=f"Leave out what is later ({help_text}).")
    start = click.option("--start", type=kind, metavar="T", help="Leave out what is earlier (likewise).")
    return start(end(command))


def iso(t_ns: int) -> str:
    """A time for people, UTC to the millisecond."""
    moment = datetime.fromtimestamp(t_ns // 1_000_000_000, UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}.{t_ns // 1_000_000 % 1000:03d}Z"
