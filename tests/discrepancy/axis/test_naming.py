"""Names of parameters and units of an axis: what goes in comes out."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.naming.linear import by_drive, in_metres, of_axis
from ema.discrepancy.axis.naming.naming import line, numbers_of, torque_line
from ema.effects import registry


def test_a_point_is_sorted_by_what_its_names_mean():
    found = numbers_of({"J": 2e-5, "stribeck.speed": 3.0, "term1.coefficient": 0.1, "zero:second": 0.2})
    assert found.parameters == {"J": 2e-5}
    assert found.effects == {"stribeck": {"speed": 3.0}}
    assert found.terms == [{"coefficient": 0.1}]
    assert found.zeros == {"second": 0.2}


def test_lines_of_torque_are_numbered_and_act_as_their_cosine_and_sine():
    point = {
        line(72.0, "cos"): 0.3,
        line(72.0, "sin"): -0.4,
        line(14.17, "cos", "gear_error"): 1.0,
        line(6.0, "sin"): 1.0,
    }
    found = numbers_of(point).effects
    assert {key: of["order"] for key, of in found.items()} == {"cogging": 6.0, "cogging#2": 72.0, "gear_error": 14.17}
    theta = np.linspace(0.0, 1.0, 50)
    of = found["cogging#2"]
    said = of["amplitude"] * np.sin(72.0 * theta + of["phase"])
    assert said == pytest.approx(0.3 * np.cos(72.0 * theta) - 0.4 * np.sin(72.0 * theta))


def test_a_line_is_found_again_beside_others():
    """Drawn from sets with other lines, order 72 had an interval that began at 71."""
    own = numbers_of({line(72.0, "cos"): 0.3, line(6.0, "sin"): 1.0, "stribeck.speed": 3.0})
    other = numbers_of({line(n, "cos"): 0.1 * n for n in (5.0, 6.0, 71.0, 72.0)} | {"stribeck.speed": 4.0})
    assert own.like("cogging#2", other) == pytest.approx(torque_line(72.0, 7.2, 0.0))
    assert own.like("cogging", other) == pytest.approx(torque_line(6.0, 0.6, 0.0))
    assert own.like("stribeck", other) == {"speed": 4.0}
    assert own.like("cogging#2", numbers_of({line(6.0, "sin"): 1.0})) is None


def test_amplitude_and_phase_are_those_of_the_parts():
    assert torque_line(5.0, 0.0, 2.0) == pytest.approx({"amplitude": 2.0, "order": 5.0, "phase": 0.0})


@pytest.mark.parametrize(
    ("rotary", "linear"),
    [("0.2 N m s/rad of drag", "0.2 N s/m of drag"), ("kg m²", "kg"), ("1e-3 N m/A", "1e-3 N/A"), ("rad/s", "m/s")],
)
def test_what_is_said_of_a_linear_axis_has_no_radians(rotary, linear):
    assert in_metres(rotary) == linear


def test_where_the_torque_itself_is_recorded_nothing_is_per_ampere():
    assert by_drive("N m/A", "torque") == "1"
    assert by_drive("N m/A", "current") == "N m/A"
    assert by_drive("offset by +1 A, V or N of the drive (current, voltage or force)", "torque") == (
        "offset by +1 N m of the torque"
    )


@pytest.mark.parametrize("name", ["constant_load", "position_friction", "spring_load", "gear_compliance"])
@pytest.mark.parametrize("linear", [False, True])
def test_an_axis_has_no_user_apart_from_it(name, linear):
    effect = registry()[name]
    said = of_axis(effect.said({p.name: 1.0 for p in effect.parameters}) + effect.separated_by, linear=linear)
    assert "user" not in said
    assert "θ_u" not in said
