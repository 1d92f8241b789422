"""What a model takes from a residual by taking the noise of the recorded drive is not counted for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.noisier import add_noise
from ema.discrepancy.selection import compare, try_at
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def plant(support):
    """An axis with a noisy current and a fine encoder, nothing hidden."""
    other = support("axis_other")
    noise = {"position": 2e-6, "speed": 0.05, "drive": 0.03, "u": 0.02, "i": 5e-3}
    setup = replace(other.SETUPS["clean"], noise=noise, channels=("i_q", "theta_m"), duration=2.0)
    return AxisPlant(RotaryAxis.model_validate(other.plant(setup)), [other.record(setup, 1)], n_threads=1)


def tried(plant, **effects):
    return try_at(plant, {**{f.name: f.start for f in plant.base}, **effects})


def test_what_is_added_is_what_smoothing_leaves_of_noise(plant):
    (bench, *_) = plant.benches
    noisier = add_noise(bench)
    for other in noisier.windows:
        assert (other.part.drive[other.first : other.first + other.n] == other.drive).all()
    added = [other.drive - w.drive for w, other in zip(bench.windows, noisier.windows, strict=True)]
    less, more = (np.std(np.concatenate(added[k::2])) for k in (0, 1))
    left = np.concatenate([w.left for w in bench.windows])
    assert less == pytest.approx(bench.noise["i_q"].sigma * np.sqrt(left.mean()), rel=0.15)
    assert less < more < 2.0 * less


def test_a_lag_that_a_clock_undoes_takes_noise_and_is_no_better_than_nothing(plant):
    """They cancel but for what the lag takes of the current's noise: residuals alone say hundreds of nats."""
    nothing, pair = tried(plant), tried(plant, **{"drive_lag.time": 3e-3, "clock_skew.late": -3e-3})
    raw = compare(replace(pair, by_noise=()), replace(nothing, by_noise=())).gain
    assert compare(pair, nothing).gain < min(raw - 100.0, 0.0)
