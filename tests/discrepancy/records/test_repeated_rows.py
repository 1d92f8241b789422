"""Rows that were lost and repeated are counted; what stays as it was by itself, or by its quantisation, is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ema.core.records import Cycle, Record, read_record
from ema.discrepancy.records.allowed import list_allowed
from ema.discrepancy.records.facts import count_repeated, sampling

DATA = Path(__file__).parents[2] / "data"
N, DT = 4000, 1e-3


def record(rest=0.0, step=0.0, lost=0.0, seed=0):
    """A sine that rests for a share of the time, current and speed in coarse steps, rows `lost` at random."""
    rng, t = np.random.default_rng(seed), DT * np.arange(N)
    theta = np.sin(2.0 * np.pi * np.where(t < rest * t[-1], 0.0, t - rest * t[-1]))
    i_q = np.round((np.cos(2.0 * np.pi * t) + 0.005 * rng.standard_normal(N)) / 0.01) * 0.01
    w_m = np.round((np.cos(2.0 * np.pi * t) + 0.005 * rng.standard_normal(N)) / 0.01) * 0.01
    theta = np.round(theta / step) * step if step else theta
    gone = rng.random(N) < lost
    gone[0] = False
    taken = np.maximum.accumulate(np.where(gone, 0, np.arange(N)))
    return Record((Cycle(1, {"t": t, "theta_m": theta[taken], "i_q": i_q[taken], "w_m": w_m[taken]}),)), int(gone.sum())


@pytest.mark.parametrize("step", [0.0, 1e-3])
def test_rows_that_were_lost_are_counted_and_told(step):
    made, n = record(step=step, lost=0.01)
    found = count_repeated(made)
    assert 0.7 * n < found < 1.6 * n
    assert any("samples were lost" in text for text in list_allowed(made, sampling(made), [], []).obstacles)


@pytest.mark.parametrize("how", [{}, {"rest": 0.5}, {"step": 1e-3}, {"step": 0.02}, {"rest": 0.5, "step": 1e-2}])
def test_what_rests_or_is_coarse_has_lost_nothing(how):
    assert all(count_repeated(record(**how, seed=seed)[0]) == 0 for seed in range(5))


@pytest.mark.parametrize("counts", [1e-3, 3e-3])
def test_a_slow_axis_goes_from_count_to_count_and_a_duty_with_it(counts):
    """A servo's duty is what it makes of its counts: where they stay it stays."""
    t = DT * np.arange(N)
    theta = np.round(np.sin(2.0 * np.pi * 0.5 * t) / counts) * counts
    slow = np.concatenate(([0.0], np.diff(theta))) / DT
    duty = 0.3 * (np.round(2.0 * t) / 2.0 - theta) - 0.002 * slow
    made = Record((Cycle(1, {"t": t, "theta_m": theta, "duty": duty}),))
    assert count_repeated(made) == 0


def test_a_real_recorder_has_lost_some():
    """Position, speed and current stay for a millisecond in which the voltage goes on, and then catch up."""
    assert 30 < count_repeated(read_record(DATA / "laas_mn4004" / "sine.csv")) < 50
    assert count_repeated(read_record(DATA / "laas_mn4004" / "speed_loop.csv")) == 0
