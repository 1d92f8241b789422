"""How far the comparators' step alone draws a record of the truth towards what a frozen trial told instead of it.

Runs of our own simulation at the hidden values, each by one step, are projected on the way from there to what was told:
0 is the truth, 1 what was told, whitened by the noise of either. What the hidden record itself does stands beside it,
and what means by each step leave of it: the step that leaves least is the record's own.

    python -m benchmarks.pulls benchmarks/trials/frozen-a05912a.jsonl --stratum "beside faults" --number 0
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import hidden_cases as cases
import numpy as np

from benchmarks import strata
from benchmarks.discrepancy import recorded
from benchmarks.frozen import bench_seed, read_rows
from ema.core.names import FAULTS
from ema.discrepancy.actuator.reading.conditions import take_recorded_conditions
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant
from ema.discrepancy.plant import Point

STEPS = (2.5e-7, 4e-7, 5e-7, 8e-7, 1e-6, 2e-6)  # [s] means of a search are by 0.8 and 1 µs in turn
MEANS, RUNS = 96, 8
SEED_OF_MEANS, SEED_OF_RUNS = 9_000_000, 77_000_000


def ends(row: dict[str, Any], values: dict[str, float]) -> tuple[Point, Point]:
    """What was hidden in a trial, and what was told of it."""
    of = {name: get(values) for name, get in cases.case(row["case"]).parameters.items()}
    told = {name: x + np.sign(row["z"][name]) * row["parameter_errors"][name] * abs(x) for name, x in of.items()}
    hidden, found = (dict(zip(FAULTS, k, strict=True)) for k in (row["k"], row["k_after"]))
    return {**hidden, **of}, {**found, **told}


@click.command()
@click.argument("rows", type=click.Path(path_type=Path, exists=True))
@click.option("--stratum", required=True)
@click.option("--number", default=0, show_default=True)
def main(rows: Path, stratum: str, number: int) -> None:
    """Print the pulls on one trial's record."""
    row = next((r for r in read_rows(rows) if (r["stratum"], r["number"]) == (stratum, number)), None)
    if row is None or not row.get("parameter_errors"):
        raise click.UsageError(f"{rows}: {stratum} {number}: " + ("no such row" if row is None else "nothing was told"))
    t = strata.drawn(stratum, number, row["seed"])
    data = prepare(t.actuator, [recorded(t.values, t.k, t.n_cycles, bench_seed(row["seed"]), t.motions, t.bench)])
    plant = EmaPlant(take_recorded_conditions(t.actuator, data.signals)[0], data, 1)
    points, every = ends(row, t.values), list(range(data.n_cycles))
    truth, told = (plant.means([p], every, MEANS, SEED_OF_MEANS)[0] for p in points)
    own = {s: plant.repeated([points[0]], every, RUNS, SEED_OF_RUNS, (s,))[0] for s in STEPS}
    for where, point in zip(("hidden", "told"), points, strict=True):
        noise = Noise(plant, point)
        way = {c: noise.of(c).white(told[c] - truth[c]) for c in every}
        square = sum(float(w @ w) for w in way.values())

        def share(of: list[np.ndarray]) -> float:
            return sum(float(noise.of(c).white(of[c] - truth[c]) @ way[c]) for c in every) / square  # noqa: B023

        click.echo(f"noise where {where}: {np.sqrt(square):.0f} deviations apart; the record {share(data.y):+.2f}")
        for s, runs in own.items():
            left = noise.misfit([noise.of(c).white(data.y[c] - runs[c].features.mean(axis=0)) for c in every], every)
            shares = [share([runs[c].features[j] for c in every]) for j in range(RUNS)]
            pulls = " ".join(f"{x:+.2f}" for x in shares)
            click.echo(f"  our own by {1e6 * s:g} µs: {pulls}; its means leave {left:.3f} of the record's noise")


if __name__ == "__main__":
    main()
