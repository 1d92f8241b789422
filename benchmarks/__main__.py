"""`python -m benchmarks [NAME...]` (= `make bench`): one table of figures with limits, peers and seeds.

Every module here that defines ``rows()`` takes part: a list of dicts with the keys figure, value, unit and, where they
mean something, limit, peer, peer_value, seed. Times are of this machine as busy as it is now; nothing is asserted.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

COLUMNS = ("module", "figure", "value", "unit", "limit", "× limit", "peer", "peer's", "× peer", "seed")


def main(chosen: list[str]) -> int:
    names = sorted(m.name for m in pkgutil.iter_modules([str(Path(__file__).parent)]) if not m.name.startswith("_"))
    if unknown := sorted(set(chosen) - set(names)):
        print(f"benchmarks: no module {', '.join(unknown)}; there are: {', '.join(names)}", file=sys.stderr)
        return 2
    table = Table(*COLUMNS)
    for name in chosen or names:
        module = importlib.import_module(f"benchmarks.{name}")
        if hasattr(module, "rows"):
            for row in module.rows():
                table.add_row(name, *_cells(row))
    Console(width=None if sys.stdout.isatty() else 180).print(table)
    return 0


def _cells(row: dict[str, Any]) -> list[str]:
    value, limit, peer = row["value"], row.get("limit"), row.get("peer_value")
    return [
        str(row["figure"]), _number(value), str(row["unit"]), _number(limit), _ratio(value, limit),
        str(row.get("peer") or ""), _number(peer), _ratio(peer, value), str(row.get("seed", "")),
    ]  # fmt: skip


def _number(x: Any) -> str:
    return "" if x is None else f"{x:.4g}" if isinstance(x, int | float) else str(x)


def _ratio(a: Any, b: Any) -> str:
    return f"{a / b:.2f}" if isinstance(a, int | float) and isinstance(b, int | float) and b else ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
