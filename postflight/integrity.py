"""What a command says at its end of a log that is not all that was written: the same everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ema.core.errors import NegativeAnswer
from ema.log import LogReader
from ema.log.foreign import ForeignLog

from .open_log import names


def conclude(log: LogReader | ForeignLog) -> None:
    """Say on standard error what contradicts itself or is missing; call when all has been read and the answer is given.

    Raises
    ------
    NegativeAnswer
        Something does: exit status 1, so that no script takes the answer for that of the whole log.
    """
    if isinstance(log, LogReader):
        tell(log.complaints(), log.remarks(), log.paths)


def tell(complaints: Sequence[str], remarks: Sequence[str], paths: list[Path]) -> None:
    """As `conclude`, of lines already gathered."""
    for line in (*remarks, *complaints):
        click.echo(line, err=True)
    if complaints:
        raise NegativeAnswer(
            f"{names(paths)}: not all that was written could be read ({len(complaints)} contradictions above); "
            "the answer is that of the rest"
        )
