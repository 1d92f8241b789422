"""A benchmark of drawn trials that goes on where it stopped: one line of a log for each trial."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def run(
    doc: str | None, log: str, trials: int, look: Callable[[int, int], Row], said: Callable[[Row], str],
    table_of: Callable[[list[Row]], str],
) -> None:  # fmt: skip
    """Run the trials that are missing, each by `look(seed, number)`, say what it gave, and print the table of all."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=trials)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--log", type=Path, default=Path(log))
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.log.read_text().splitlines()] if args.log.exists() else []
    rows = [row for row in rows if row["seed"] == args.seed]
    done = {row["number"] for row in rows}
    args.log.parent.mkdir(parents=True, exist_ok=True)
    print(f"seed {args.seed}")
    for number in range(args.trials):
        if number not in done:
            rows.append(look(args.seed, number))
            with args.log.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print(number, said(rows[-1]), flush=True)
    print(table_of(rows))
