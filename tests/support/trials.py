"""Trials of the benchmark by their seeds, examined again."""

from __future__ import annotations

from benchmarks import discrepancy, frozen
from benchmarks.strata import Trial
from benchmarks.strata import drawn as draw
from ema.discrepancy.actuator.examine import Examination, examine
from ema.discrepancy.actuator.reading.cycles import prepare


def examine_drawn(stratum: str, number: int, seed: int) -> tuple[Trial, Examination]:
    """What is hidden in an actuator's trial, and its examination."""
    a = draw(stratum, number, seed)
    record = discrepancy.recorded(a.values, a.k, a.n_cycles, frozen.bench_seed(seed), a.motions, a.bench, a.spoil)
    return a, examine(a.actuator, prepare(a.actuator, [record]))
