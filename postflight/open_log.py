"""Logs named on the command line: MCAP segments as one, or raw logs of other tools."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

import click

from ema.core.errors import LogError
from ema.log.foreign import SUFFIXES, ForeignLog
from ema.log.reader import LogReader, find_logs

from .times import TimeOption, limits

Opened = TypeVar("Opened", bound=LogReader | ForeignLog)


def open_log(paths: Iterable[Path], start: TimeOption = None, end: TimeOption = None) -> LogReader | ForeignLog:
    """Open MCAP logs, or raw logs of other tools; not both at once.

    Parameters
    ----------
    paths : paths
        Files or directories.
    start, end : functions of the first time [ns], optional
        What `times.TimeParameter` gives.

    Raises
    ------
    LogError
        A file is missing, or of a kind that is not known.
    """
    paths = list(paths)
    found = find_logs(paths, (".mcap", *SUFFIXES))
    kinds = {path.suffix.lower() == ".mcap" for path in found}
    if len(kinds) > 1:
        raise LogError("MCAP logs and logs of other tools cannot be read as one: name one kind only")
    log: LogReader | ForeignLog = LogReader(paths) if kinds == {True} else ForeignLog(found)
    return _within(log, start, end)


def open_mcap(paths: Iterable[Path], start: TimeOption = None, end: TimeOption = None) -> LogReader:
    """Open MCAP logs only. LogError as `open_log`."""
    return _within(LogReader(paths), start, end)


def _within(log: Opened, start: TimeOption, end: TimeOption) -> Opened:
    try:
        log.start_ns, log.end_ns = limits(log.first_ns() or 0, start, end)
    except click.UsageError:
        log.close()
        raise
    return log


def names(paths: list[Path]) -> str:
    """Logs for a message: the first, and how many more."""
    return f"{paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")
