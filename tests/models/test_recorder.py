"""What the recorder alone makes of the channels leaves the actuator as it is."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core import config, resources
from ema.models import hf
from ema.models.actuator import Actuator

PLANT = config.load(resources.config("actuator.yaml"), Actuator)
COMMAND = PLANT.command()[:1500]


def run(**effects) -> hf.Response:
    return hf.simulate(PLANT, np.zeros(6), COMMAND, noise=False, effects=effects)


@pytest.fixture(scope="module")
def true() -> hf.Response:
    return run()


def test_gains_and_offsets_of_the_recorder_are_in_the_record_alone(true):
    r = run(recorder_gain={"gain_a": -0.04}, recorder_offset={"offset_b": 0.15})
    np.testing.assert_allclose(r.i[0, 0], 0.96 * true.i[0, 0], atol=1e-12)
    np.testing.assert_allclose(r.i[0, 1], true.i[0, 1] + 0.15, atol=1e-12)
    for name in ("theta_m", "theta_u", "I_ref"):
        np.testing.assert_array_equal(getattr(r, name), getattr(true, name))


def test_the_converter_clips_and_rounds_what_the_recorder_makes_of_the_current():
    i = hf.simulate(PLANT, np.zeros(6), COMMAND, effects={"recorder_offset": {"offset_a": 100.0}}).i[0, 0]
    assert i == pytest.approx(PLANT.sensors.adc_range, abs=PLANT.sensors.adc_step)


def test_a_late_recorder_shows_the_position_of_before(true):
    T = 1.0 / PLANT.control.rate
    r = run(recorder_delay={"time": 12.5 * T})
    between = 0.5 * (true.theta_u[0, :-13] + true.theta_u[0, 1:-12])
    np.testing.assert_allclose(r.theta_u[0, 13:], between, atol=1e-12)
    np.testing.assert_array_equal(r.theta_m, true.theta_m)


def test_behind_the_tap_the_controller_sees_what_the_record_showed_before():
    """The controller's law holds for the recorded position so long ago; without the delay it holds at once."""
    n = 20
    c, late = PLANT.control, n / PLANT.control.rate
    r = run(controller_delay={"time": late})
    asked = c.K_w * (c.K_p * (COMMAND[n:] - r.theta_u[0, :-n]) - r.w_m[0, n:])
    limit = PLANT.inverter.I_max
    np.testing.assert_allclose(r.I_ref[0, n:], np.clip(asked, -limit, limit), atol=1e-9)


def test_delays_before_and_behind_the_tap_add_up_for_the_controller():
    both = run(position_delay={"time": 8e-4}, controller_delay={"time": 5e-4})
    behind = run(controller_delay={"time": 13e-4})
    np.testing.assert_allclose(both.I_ref, behind.I_ref, atol=1e-9)
    np.testing.assert_allclose(both.theta_u[0, 8:], behind.theta_u[0, :-8], atol=1e-12)
