"""`python -m benchmarks [NAME...]` (= `make bench`): one table of figures with limits, peers and ratios.

Every module here that defines ``rows()`` takes part: a list of dicts with the keys figure, value, unit and, where they
mean something, limit, peer, peer_value, seed, and `more`: True where more is better. "of limit" is the value's share of
its limit, at most 1 where the limit is kept; "better" is how many times better than the peer. Times are of this machine
as busy as it is now; nothing is asserted.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import platform
import sys
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

COLUMNS = ("figure", "this machine", "unit", "limit", "of limit", "peer", "peer's", "better", "seed")
NUMBERS = ("this machine", "limit", "of limit", "peer's", "better")
WIDTH = 180  # where the output is no terminal


def main(chosen: list[str]) -> int:
    names = sorted(m.name for m in pkgutil.iter_modules([str(Path(__file__).parent)]) if not m.name.startswith("_"))
    if unknown := sorted(set(chosen) - set(names)):
        print(f"benchmarks: no module {', '.join(unknown)}; there are: {', '.join(names)}", file=sys.stderr)
        return 2
    table = Table(title=_machine())
    for column in COLUMNS:
        table.add_column(
            column, justify="right" if column in ("this machine", "limit", "of limit", "better") else "left"
        )
    for name in chosen or names:
        module = importlib.import_module(f"benchmarks.{name}")
        if hasattr(module, "rows"):
            began = time.perf_counter()
            for row in module.rows():
                table.add_row(*_cells(row))
            table.add_section()
            print(f"{name}: {time.perf_counter() - began:.0f} s", file=sys.stderr)
        elif chosen:
            print(
                f"benchmarks: {name} has no row in the table; see python -m benchmarks.{name} --help", file=sys.stderr
            )
    Console(width=None if sys.stdout.isatty() else WIDTH).print(table)
    return 0


def _machine() -> str:
    models = [
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    ]
    name = models[0] if models else platform.processor()
    return f"{len(models)} × {name}, Python {platform.python_version()}, load average {os.getloadavg()[0]:.1f}"


def _cells(row: dict[str, Any]) -> list[str]:
    value, limit, peer, more = row["value"], row.get("limit"), row.get("peer_value"), row.get("more", False)
    return [
        str(row["figure"]), _number(value), str(row["unit"]),
        _number(limit), _ratio(limit, value) if more else _ratio(value, limit),
        str(row.get("peer") or ""), _number(peer), _ratio(value, peer) if more else _ratio(peer, value),
        str(row.get("seed", "")),
    ]  # fmt: skip


def _number(x: Any) -> str:
    return "" if x is None else f"{x:.4g}" if isinstance(x, int | float) else str(x)


def _ratio(a: Any, b: Any) -> str:
    return f"{a / b:.3g}" if isinstance(a, int | float) and isinstance(b, int | float) and b else ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
