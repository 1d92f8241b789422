"""Trials of the benchmark by their seeds, examined again."""

from __future__ import annotations

from benchmarks import discrepancy, frozen
from benchmarks.strata import Trial
from benchmarks.strata import drawn as draw
from ema.discrepancy.actuator.examine import Examination, examine
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.measured import Measured


def prepare_drawn(stratum: str, number: int, seed: int) -> tuple[Trial, Measured]:
    """What is hidden in an actuator's trial, and its record."""
    a = draw(stratum, number, seed)
    record = discrepancy.recorded(a.values, a.k, a.n_cycles, frozen.bench_seed(seed), a.motions, a.bench, a.spoil)
    return a, prepare(a.actuator, [record])


def examine_drawn(stratum: str, number: int, seed: int) -> tuple[Trial, Examination]:
    """What is hidden in an actuator's trial, and its examination."""
    a, data = prepare_drawn(stratum, number, seed)
    return a, examine(a.actuator, data)
