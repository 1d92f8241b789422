"""The table of attacks, on a terminal and in a page."""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

BEGIN, END = "<!-- attacks: written by make test-adversary -->", "<!-- attacks: end -->"
HEAD = ("attack", "times", "what happens", "what is lost", "test")


class Row(NamedTuple):
    """What came of one attack."""

    attack: str
    times: Any
    outcome: str
    lost: str
    test: str


def as_text(rows: Sequence[Row]) -> str:
    """For a terminal."""
    table = Table(*HEAD, title="attacks on a daemon process")
    for row in rows:
        table.add_row(*map(str, row))
    out = io.StringIO()
    Console(file=out, width=180).print(table)
    return out.getvalue()


def as_line(row: Row) -> str:
    """In Markdown."""
    cells = [str(cell).replace("|", "/").replace("\n", " ") for cell in (*row[:-1], f"`{row.test}`")]
    return f"| {' | '.join(cells)} |"


def replaced(page: str, rows: Sequence[Row], suite: Collection[str]) -> str:
    """The page with these rows in its table; those of tests that were not run stay while they are in the suite."""
    run = {row.test for row in rows}
    before, _, rest = page.partition(BEGIN)
    table, _, after = rest.partition(END)
    kept = {name: [] for name in suite - run}
    for line in table.splitlines():
        if (name := _test(line)) in kept:
            kept[name].append(line)
    lines = [*(as_line(row) for row in rows), *(line for own in kept.values() for line in own)]
    lines.sort(key=lambda line: (_test(line), line))
    head = [f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}"]
    return "\n".join([before + BEGIN, *head, *lines, END + after])


def told(page: str) -> list[str]:
    """Names of the tests in the page's table."""
    table = page.partition(BEGIN)[2].partition(END)[0]
    return [_test(line) for line in table.splitlines() if _test(line)]


def attacks(folder: Path) -> set[str]:
    """Names of the suite's tests."""
    return {
        name for path in folder.glob("test_*.py") for name in re.findall(r"^def (test_\w+)", path.read_text(), re.M)
    }


def _test(line: str) -> str:
    found = re.search(r"`(test_\w+)` \|$", line)
    return found[1] if found else ""
