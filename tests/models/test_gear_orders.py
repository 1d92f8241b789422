"""Orders of gears against counts of what meets in one turn of the motor."""

from __future__ import annotations

import pytest

from ema.core.errors import ConfigError
from ema.models import axis_config
from ema.models.gear_orders import gear_orders


def test_spur_gears_mesh_as_often_as_driving_teeth_pass():
    orders = gear_orders("spur", 12.0, (20, 60, 15, 60))
    assert sorted(orders) == pytest.approx([1.0 / 12.0, 1.0 / 3.0, 5.0, 20.0])


def test_a_planetary_gear_meshes_as_often_as_ring_teeth_pass_the_carrier():
    """The carrier makes 1/6 turn: 85/6 teeth of the ring pass a planet."""
    assert min(abs(n - 85.0 / 6.0) for n in gear_orders("planetary", 6.0, (17, 85))) < 1e-12


def test_a_wave_generator_errs_twice_per_turn():
    assert {2.0, 4.0, 0.01} == set(gear_orders("harmonic", 100.0, ()))


def test_orders_are_told_for_the_side_that_was_measured():
    axis = {"J": 1e-4, "F_d": 0.02, "k_t": 0.05, "gear": 6.0, "gear_kind": "planetary", "teeth": (17, 85)}
    motor = axis_config.RotaryAxis.model_validate(axis).gear_orders
    load = axis_config.RotaryAxis.model_validate({**axis, "measured_at": "load"}).gear_orders
    assert [6.0 * n for n in motor] == pytest.approx(list(load))


@pytest.mark.parametrize(
    ("gear", "says"),
    [
        ("gear_kind: planetary\ngear: 6\nteeth: [17]", "two numbers (sun, ring)"),
        ("gear_kind: spur\ngear: 6\nteeth: [17, 20, 5]", "two for each stage"),
        ("gear_kind: planetary\ngear: 6\nteeth: [85, 17]", "the sun has fewer teeth"),
        ("gear_kind: harmonic", "needs gear"),
    ],
)
def test_a_gear_that_cannot_be_is_refused_in_words(tmp_path, gear, says):
    file = tmp_path / "plant.yaml"
    file.write_text(f"kind: axis\nJ: 1e-4\nF_d: 0.02\nk_t: 0.05\n{gear}\n")
    with pytest.raises(ConfigError, match=says.replace("(", r"\(").replace(")", r"\)")):
        axis_config.load(file)
