"""Whether sizes hold what they claim where the cause is known: fitted from the truth, without a search.

    python -m benchmarks.sizes --trials 40 --out var/sizes.jsonl

Trials are those of `benchmarks.frozen` with one effect, alone and beside faults, brought to their minimum as an answer
is; each takes half a minute of a core.
Prints the share of sizes within intervals of 50, 90 and 95 %, as the score has them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import hidden_cases as cases
import numpy as np

from ema.core.names import FAULTS
from ema.discrepancy.actuator.examine import begin
from ema.discrepancy.actuator.fitting.candidates import Candidate, candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Search, start_model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.scoring.entrants import weigh
from ema.discrepancy.progress import Progress

from . import strata
from .discrepancy import recorded
from .frozen import bench_seed, run_missing
from .frozen_table import coverage

STRATA = ("one effect", "beside faults")


def _candidate(search: Search, effect: str, parameters: set[str]) -> Candidate | None:
    """The way an effect may act that has these parameters free."""
    of = [c for c in candidates(search.plant.plant, search.plant.data, ()) if c.effect == effect]
    return next((c for c in of if parameters <= {f.name for f in c.frees}), None)


def deviations(stratum: str, number: int, s: int) -> dict[str, float] | None:
    """How far off each size is, in its deviations; none where no candidate has the parameters of what is hidden."""
    t = strata.drawn(stratum, number, s)
    true = {p: x for p, of in cases.case(t.case).parameters.items() if (x := of(t.values))}
    faults = dict(zip(FAULTS, t.k, strict=True))
    record = recorded(t.values, t.k, t.n_cycles, bench_seed(s), t.motions, t.bench, t.spoil)
    search, _ = begin(t.actuator, prepare(t.actuator, [record]), 1, Progress(), faults | true)
    names = dict.fromkeys(p.split(".")[0] for p in true)
    found = [_candidate(search, name, {p for p in true if p.startswith(f"{name}.")}) for name in names]
    effects = [c for c in found if c is not None]
    if not effects or len(effects) < len(found):
        return None
    free = (*K_FREE, *(f for c in effects for f in c.frees))
    fitted = search.model(effects, free, faults | true, None, 4)
    outcome = weigh(search, [start_model(search, faults), search.at_minimum(fitted)])
    w = next(w for w in outcome.weighed if set(w.entrant.names) == set(names))
    return {p: (w.point[p] - x) / w.sd[p] for p, x in (faults | true).items() if x}


def table(rows: list[dict[str, Any]]) -> str:
    """Shares of faults, of effects' sizes and of both within each interval."""
    z = [(name, x) for row in rows for name, x in (row["z"] or {}).items()]
    parts = {"faults": lambda n: n in FAULTS, "sizes of effects": lambda n: n not in FAULTS, "all": lambda n: True}
    lines = [f"commit {rows[0]['commit'][:8]}, {len(rows)} trials"]
    for what, belongs in parts.items():
        of = [x for name, x in z if belongs(name)]
        shares = ", ".join(f"{name}: {share}" for name, share in coverage(of))
        lines.append(f"{what} ({len(of)}, rms {np.sqrt(np.mean(np.square(of))):.2f}): {shares}")
    return "\n".join(lines)


@click.command()
@click.option("--trials", default=40, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("var/sizes.jsonl"), show_default=True)
def main(trials: int, out: Path) -> None:
    """Run the trials of this commit that are missing, and print the table."""
    of = dict.fromkeys(STRATA, trials // len(STRATA))
    rows = run_missing(
        out, of, lambda *of: {"z": deviations(*of)}, lambda row: f"{row['stratum']} {row['number']}: {row['z']}"
    )
    click.echo(table(rows))


if __name__ == "__main__":
    main()
