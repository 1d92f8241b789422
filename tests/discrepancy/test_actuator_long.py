"""Long records: their noise is that of short ones, and no more cycles are examined than are needed."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.fit import residuals
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.thinning import thin
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

TRUTH = {"k1": 0.05, "k4": 0.04}


def record(cycles):
    return [Record(tuple(Cycle(number, channels) for number, channels in enumerate(cycles)))]


@pytest.mark.slow
def test_noise_is_the_same_however_many_cycles_there_are(hidden, shipped_plant):
    """With five runs of each of thirty cycles the truth had left 1.5 times what noise was said to make."""
    cycles = hidden.cycles(hidden.Flaws(**TRUTH), 6, 11, hidden.MOTIONS[:1])
    few, many = (
        misfit_at_the_truth(EmaPlant(shipped_plant, prepare(shipped_plant, record(c)))) for c in (cycles, 8 * cycles)
    )
    assert few == pytest.approx(1.0, abs=0.2)
    assert many == pytest.approx(few, rel=0.1)


def misfit_at_the_truth(plant):
    """Of the first six cycles."""
    noise = Noise(plant, TRUTH)
    left = residuals(plant, noise, TRUTH, range(6), 16)
    return noise.misfit(list(left.values()), range(6))


def test_a_long_record_is_thinned_alike_in_every_motion(hidden, shipped_plant):
    often, once = (hidden.cycles(hidden.Flaws(), 1, 1, [motion])[0] for motion in hidden.MOTIONS[:2])
    data, told = thin(prepare(shipped_plant, record([often] * 20 + [once] + [often] * 19)), 10)
    assert told == "10 of 40 cycles were examined, spread over the records; --cycles chooses others"
    assert data.n_cycles == len(data.signals) == len(data.start) == 10
    assert np.bincount(data.motion).tolist() == [9, 1]
    assert data.labels[0].endswith("0")
    assert data.labels[-1].endswith("39")
    assert thin(data, 10) == (data, None)
