"""Whether intervals hold what they claim: shares of true faults inside, by the second simulator, on three plants.

    python -m benchmarks.intervals --cycles 80 --out var/intervals.jsonl

Plants are those of tests/support/hidden_actuator.py, which also makes the measured cycles; bundles are of the quick
configuration (kept in the cache). Every cycle is a line of the file, and a cycle that is there is not run again; lines
of another commit are not mixed with this one's. Prints the table of docs/reproduction.md.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import click
import hidden_actuator as hidden
import numpy as np

from ema.bundle import Bundle
from ema.identification import Measurement, identifier
from ema.models.envelope import envelope

from .frozen import begun, of_one_commit
from .identification import quick_bundle
from .strata import as_actuator

SEED = 20261124
SETS = {"U(0, 0.05)": 0.05, "U(0, 0.3)": 0.3}
METHODS = ("linear", "lf2", "hf")
LEVELS = (0.5, 0.9, 0.95)
AIM = 0.03  # share by which an interval may miss its level
DOUBTED = 0.01  # level of the test of fit that is counted
PLANTS = tuple(hidden.PLANTS)


def measured(b: Bundle, plant: str, k: np.ndarray, seed: int) -> Measurement:
    """One cycle of the second simulator, cold, with faults `k` (6,)."""
    bench = hidden.BENCH._replace(nominal=hidden.PLANTS[plant])
    state, flaws = hidden.rest(nominal=bench.nominal), hidden.Flaws(*k)
    hidden.cycle(flaws, np.zeros(500), state, seed, bench)
    record = hidden.cycle(flaws, b.plant.command(), state, seed + 1, bench)
    i = np.array([record[name] for name in ("i_a", "i_b", "i_c")])
    start = np.array([record["theta_u"][0], record["theta_m"][0] / b.plant.transmission.GR])
    return Measurement.complete(envelope(i, b.rate)[b.schedule], start)


def answers(b: Bundle, plant: str, faults: str, number: int) -> Iterator[dict[str, Any]]:
    """What each identifier claims of one cycle, and whether it holds."""
    stream = [SEED, PLANTS.index(plant), list(SETS).index(faults), number]
    seed = int(np.random.SeedSequence(stream).generate_state(1)[0]) // 1000
    k = np.random.default_rng(seed).uniform(0.0, SETS[faults], 6)
    cycle = measured(b, plant, k, seed)
    for method in METHODS:
        begun = time.process_time()
        e = identifier(method, b).estimate(cycle)
        limits = [e.interval(level) for level in LEVELS]
        yield {
            "plant": plant, "set": faults, "number": number, "method": method, "seed": seed, "k": k.tolist(),
            "err_k": float(np.linalg.norm(e.k - k) / 6**0.5), "p_value": e.p_value,
            "held": [((low <= k) & (k <= high)).tolist() for low, high in (x.T for x in limits)],
            "cpu_s": time.process_time() - begun,
        }  # fmt: skip


def missing(n: int, done: list[dict[str, Any]]) -> Iterator[tuple[str, str, int]]:
    """Plants, sets and numbers of cycles not there, in turn, so that an unfinished run has some of each."""
    there = {(row["plant"], row["set"], row["number"]) for row in done}
    return (c for number in range(n) for p in PLANTS for s in SETS if (c := (p, s, number)) not in there)


def table(found: list[dict[str, Any]]) -> str:
    """Shares with the standard errors of means over cycles: faults of one cycle err together. Bold: beyond the aim."""
    lines = [
        f"Commit {of_one_commit(found)[:9]}, seed {SEED}. **Bold**: more than {100 * AIM:.0f} points off.\n",
        "| plant | faults | method | cycles | median err_k | 50 % | 90 % | 95 % | p < 0.01 |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, plants in (*((plant, [plant]) for plant in PLANTS), ("all", list(PLANTS))):
        for faults, method in product(SETS, METHODS):
            these = [r for r in found if r["plant"] in plants and r["set"] == faults and r["method"] == method]
            if len(these) > 1:
                lines.append(f"| {name} | {faults} | {method} | {_cells(these)} |")
    return "\n".join(lines)


def _cells(these: list[dict[str, Any]]) -> str:
    held = np.array([r["held"] for r in these]).mean(axis=2)
    shares, errors = held.mean(axis=0), held.std(axis=0, ddof=1) / np.sqrt(len(held))
    mark = np.where(np.abs(shares - LEVELS) > AIM, "**", "")
    cells = [f"{m}{share:.3f}{m} ± {error:.3f}" for m, share, error in zip(mark, shares, errors, strict=True)]
    doubted = np.mean([r["p_value"] < DOUBTED for r in these])
    return " | ".join([str(len(these)), f"{np.median([r['err_k'] for r in these]):.4f}", *cells, f"{doubted:.3f}"])


@click.command()
@click.option("--cycles", default=80, show_default=True, help="of each plant and set of faults; six claims each")
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/intervals.jsonl"), show_default=True)
def main(cycles: int, out: Path) -> None:
    """Run the cycles of this commit that are missing, and print the table."""
    found, here = begun(out)
    bundles = {plant: quick_bundle(as_actuator(hidden.PLANTS[plant])) for plant in PLANTS}
    for plant, faults, number in missing(cycles, found):
        new = [{"commit": here, **row} for row in answers(bundles[plant], plant, faults, number)]
        found += new
        with out.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in new)
        click.echo(f"{plant}, {faults}, cycle {number + 1} of {cycles}", err=True)
    click.echo(table(found))


if __name__ == "__main__":
    main()
