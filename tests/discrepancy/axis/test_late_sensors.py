"""Windows of a record whose sensors are late: what these show at first happened before the window."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.core.records import Cycle
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

SWING = on_paper.Swing(((2.5, 2.3, 0.3), (0.04, 80.0, 1.1)))  # a jerk that no constant acceleration follows
LATE = 3.4e-3
FIRST = 4  # samples that show what was before


def late_cycle(**late):
    """A cycle whose position and speed are those of `theta_m` and `w_m` seconds ago."""
    right = on_paper.cycle(swing=SWING)
    shown = {name: right[name] for name in right.channels}
    for place, name in enumerate(("theta_m", "w_m")):
        then, now = (SWING.at(right["t"] - back)[place] for back in (late.get(name, 0.0), 0.0))
        shown[name] = right[name] + then - now
    return Cycle(0, shown)


@pytest.mark.parametrize(("channel", "effect"), [("theta_m", "position_delay"), ("w_m", "speed_delay")])
def test_what_a_late_sensor_shows_at_first_is_the_motion_before_the_window(channel, effect):
    plant = on_paper.plant(late_cycle(**{channel: LATE}))
    at = {"F_d": on_paper.F_D, f"{effect}.time": LATE}
    windows = [j for j, w in enumerate(plant.windows) if w.begin(FIRST) == w.first - FIRST]
    assert len(windows) > 20
    row = plant.benches[0].roles.outputs.index(channel)
    first = np.array([r[row, 1:FIRST] for r in plant.whitened(at, windows)])
    assert np.mean(first**2) < 1.5


def test_a_window_is_led_in_no_further_than_the_axis_moved_as_in_it():
    plant = on_paper.plant(on_paper.cycle(swing=SWING))
    for w in plant.windows:
        t, drive, _ = w.led_in(50)
        assert len(t) == len(drive) == w.first - w.begin(50) + w.n
        assert (t[-w.n :] == w.t).all()
        lead = w.part.speed[w.begin(50) : w.first]
        assert (np.sign(lead) == np.sign(w.speed[0])).all()


def test_a_delay_of_next_to_nothing_leaves_what_none_does(support):
    """A current of which only the voltage is recorded shows how it began: windows begin before that shows."""
    other = support("axis_other")
    setup = other.SETUPS["voltage"]
    plant = AxisPlant(RotaryAxis.model_validate(other.plant(setup)), [other.record(setup, 5)])
    everything = range(len(plant.blocks))
    at = {f.name: f.start for f in plant.base}
    left = [
        sum(float(np.sum(r**2)) for r in plant.whitened({**at, "speed_delay.time": late}, everything))
        for late in (0.0, 1e-9)
    ]
    assert left[1] == pytest.approx(left[0], abs=1.0)
