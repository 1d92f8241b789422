"""What came of it: true against estimated faults, as numbers and as a table."""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from ema.core.errors import LogError, NegativeAnswer
from ema.core.names import FAULTS
from ema.log import LogReader

from .stage import Files

N_ROWS = 14  # of the table on the terminal


@dataclass(frozen=True)
class Flight:
    """Cycles of the flight.

    Attributes
    ----------
    cycle : array of int, shape (n,)
    k : array, shape (n, 6)
        True faults.
    estimates : dict of method to list of message contents
        As logged, by cycle.
    """

    cycle: np.ndarray
    k: np.ndarray
    estimates: dict[str, dict[int, dict]]


def read(files: Files) -> Flight:
    """True faults by the simulator, estimates by the daemon's log."""
    with files.truth.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    estimates: dict[str, dict[int, dict]] = {"linear": {}, "lf2": {}}
    with LogReader(files.log) as log:
        if log.unfinished:
            raise LogError(f"{log.unfinished[0]}: is not finished")
        for message in log.messages(lambda topic: topic.startswith("/estimate/")):
            estimates[message.content["method"]][message.content["cycle"]] = message.content
    if not estimates["linear"]:
        raise NegativeAnswer(f"the daemon has estimated nothing, see {files.said}")
    k = np.array([[float(row[name]) for name in FAULTS] for row in rows])
    return Flight(np.array([int(row["cycle"]) for row in rows]), k, estimates)


def table(flight: Flight) -> Table:
    """True against estimated faults over time, those that grow, for the terminal."""
    shown = np.flatnonzero(flight.k.max(axis=0) > 0).tolist()
    out = Table(title="true and estimated faults", caption="cycles that both looked at; linear sees all")
    out.add_column("cycle", justify="right")
    for n in shown:
        for kind in ("true", "linear", "lf2"):
            out.add_column(f"{FAULTS[n]}\n{kind}", justify="right")
    out.add_column("linear is", no_wrap=True)
    both = np.flatnonzero(np.isin(flight.cycle, list(flight.estimates["lf2"])))
    candidates = both if both.size else np.arange(len(flight.cycle))
    for row in candidates[np.unique(np.linspace(0, len(candidates) - 1, N_ROWS).round().astype(int))]:
        cycle = int(flight.cycle[row])
        linear, lf2 = flight.estimates["linear"].get(cycle), flight.estimates["lf2"].get(cycle)
        cells = [str(cycle)]
        for n in shown:
            cells += [f"{flight.k[row, n]:.3f}", _cell(linear, n), _cell(lf2, n)]
        out.add_row(*cells, linear["status"] if linear else "missing")
    return out


def _cell(estimate: dict | None, n: int) -> str:
    return "" if estimate is None or estimate["k"][n] is None else f"{estimate['k'][n]:.3f}"


def write_table(files: Files, flight: Flight) -> None:
    """Everything as CSV."""
    with files.table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        kinds = [f"{name} {kind}" for kind in ("true", "linear", "linear sd", "lf2", "lf2 sd") for name in FAULTS]
        writer.writerow(["cycle", *kinds, "linear status", "lf2 status"])
        for cycle, k in zip(flight.cycle.tolist(), flight.k.tolist(), strict=True):
            row = [cycle, *k]
            found = [flight.estimates[method].get(cycle) for method in ("linear", "lf2")]
            for estimate in found:
                row += [*estimate["k"], *estimate["sd"]] if estimate else [""] * 12
            writer.writerow([*row, *(e["status"] if e else "" for e in found)])
