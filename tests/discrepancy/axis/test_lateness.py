"""Which of two channels is late, told by position and speed alone; and named beside an inertia that is off."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import strata_axis
from ema.core.records import Cycle
from ema.discrepancy.axis.examine import findings
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.reading.lateness import see_delays
from ema.models.axis_config import RotaryAxis


def swept(position_late=0.0, speed_late=0.0, noise=1.0):
    """A chirp of a radian, with the noise of an encoder and of a speed sensor."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 2.0, 1e-3)
    theta = np.sin(2.0 * np.pi * (1.0 + 2.0 * (t - position_late)) * (t - position_late))
    later = t - speed_late
    w = 2.0 * np.pi * (1.0 + 4.0 * later) * np.cos(2.0 * np.pi * (1.0 + 2.0 * later) * later)
    channels = {
        "t": t,
        "theta_m": theta + noise * 1e-4 * rng.standard_normal(len(t)),
        "w_m": w + noise * 0.05 * rng.standard_normal(len(t)),
    }
    return [Cycle(0, channels)]


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("late", [1.2e-3, 3.5e-3, 0.012])
def test_a_late_speed_and_a_late_position_are_told_to_a_twentieth_of_a_sample(late, noise):
    of_speed = see_delays(swept(speed_late=late, noise=noise), "theta_m", "w_m")
    assert of_speed == {"speed_delay": pytest.approx(late, abs=5e-5)}
    of_position = see_delays(swept(position_late=late, noise=noise), "theta_m", "w_m")
    assert of_position == {"position_delay": pytest.approx(late, abs=5e-5)}


@pytest.mark.parametrize("noise", [0.0, 1.0, 20.0])
def test_where_both_are_in_time_or_nothing_moves_there_is_none(noise):
    assert see_delays(swept(noise=noise), "theta_m", "w_m") == {}
    still = [Cycle(0, {"t": np.arange(500) * 1e-3, "theta_m": np.ones(500), "w_m": np.zeros(500)})]
    assert see_delays(still, "theta_m", "w_m") == {}
    assert see_delays([], "theta_m", "w_m") == {}


@pytest.mark.slow
def test_a_late_speed_and_an_inertia_that_is_off_are_named_where_neither_gains_alone():
    """Each alone leaves more than none of them, and both leave noise."""
    trial = strata_axis.drawn("two effects", 8, 2987891335)
    assert trial.effects == ("speed_delay", "inertia")
    plant = AxisPlant(RotaryAxis.model_validate(trial.plant_file), trial.records)
    found = {e["name"]: e for e in findings(plant, examine_ways(plant)).as_dict()["effects"]}
    assert found.keys() == {"speed_delay", "inertia"}
    assert found["speed_delay"]["parameters"]["time"]["value"] == pytest.approx(3.5e-3, rel=0.01)
    assert found["inertia"]["parameters"]["change"]["value"] == pytest.approx(trial.truth["inertia.change"], rel=0.01)
