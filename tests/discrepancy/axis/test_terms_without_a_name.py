"""Structure that no effect explains: which family of terms the torque residual suggests, and in which words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import on_paper
import pytest

from ema.core.records import Cycle
from ema.discrepancy.axis.finding.describe import structure as said
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.scanning.structure import search
from ema.models.axis_config import LinearAxis, RotaryAxis

AT = {"F_d": on_paper.F_D}
ROTARY = SimpleNamespace(plant=RotaryAxis(J=1e-4, F_d=0.01, k_t=0.05))
LINEAR = SimpleNamespace(plant=LinearAxis(motion="linear", M=1.0, F_d=1.0, drive="force"))


def even(t, theta, w):
    return 2e-3 * np.abs(w)


def swinging(t, theta, w):
    return 5e-3 * np.sin(2.0 * np.pi * 9.3 * t + 0.4)


def bump(t, theta, w):
    return 8e-3 * np.exp(-(((theta - 1.0) / 0.25) ** 2))


def once(t, theta, w):
    return 6e-3 * np.sign(w) * np.exp(-(((t - 3.1) / 0.3) ** 2))


def found_of(opposing, seed=1, swing=None):
    plant = on_paper.plant(on_paper.cycle(opposing, seed, swing))
    found = search(plant, AT, on_paper.everywhere(plant))
    return found, plant


def as_said(candidate, plant=ROTARY):
    return said(plant, [candidate], candidate.starts[0])


def test_a_force_even_in_speed_is_said_as_that():
    (best, *_), _ = found_of(even)
    assert best.effect == "even in speed"
    assert best.starts[0]["term1.coefficient"] == pytest.approx(2e-3, rel=0.05)
    told = as_said(best)
    assert told["terms"][0]["sentence"] == "a torque even in speed, coefficient 0.002"
    assert told["depends_on"] == ["speed"]


def test_a_torque_that_swings_in_time_has_its_frequency_and_no_order():
    (best, *_), plant = found_of(swinging, swing=on_paper.Swing(((1.2, 2.3, 0.3), (0.4, 7.1, 1.1), (0.15, 17.0, 0.2))))
    assert best.effect == "time line"
    told = as_said(best)
    assert told["frequencies"] == [pytest.approx(9.3, abs=0.1)]
    assert told["orders"] == []
    assert told["depends_on"] == ["time"]
    assert "swings with 9.3" in told["terms"][0]["sentence"]
    again, *_ = search(plant, AT | best.starts[0], on_paper.everywhere(plant))
    assert again.free[0].name.startswith("term2.")  # beside the first


def test_a_place_of_the_travel_has_its_centre_and_size():
    (best, *_), _ = found_of(bump)
    assert best.effect == "torque around a position"
    start = best.starts[0]
    assert start["term1.angle_centre"] == pytest.approx(1.0, abs=0.15)
    assert start["term1.coefficient"] == pytest.approx(8e-3, rel=0.2)
    assert as_said(best)["depends_on"] == ["angle"]


def test_friction_that_comes_and_goes_is_called_intermittent():
    (best, *_), _ = found_of(once)
    assert best.effect == "friction around a time"
    told = as_said(best)
    assert best.starts[0]["term1.time_centre"] == pytest.approx(3.1, abs=0.2)
    assert told["terms"][0]["sentence"].startswith("friction changes by +0.00")
    assert "intermittent" in told["terms"][0]["sentence"]
    assert told["depends_on"] == ["time", "sign of speed"]


def test_whatever_swings_with_the_motion_is_not_said_to_swing_in_time():
    found, _ = found_of(lambda t, theta, w: 1e-4 * w**3, swing=on_paper.Swing(((2.5, 2.3, 0.3),)))
    assert found
    assert all(c.effect != "time line" for c in found)


@pytest.mark.parametrize("seed", range(3))
def test_noise_suggests_nothing_and_a_recorded_torque_does_not_explain_itself(seed):
    """The current holds what is looked for and its own noise: as a regressor it took all of the residual."""
    found, _ = found_of(on_paper.nothing, seed)
    assert found == []


def test_a_torque_by_the_square_of_the_current_comes_back():
    """A motor that saturates gives less than k_t i."""
    plant = on_paper.plant(on_paper.cycle())
    (cycle,) = plant.records[0].cycles
    i = cycle["i_q"]
    more = on_paper.plant(Cycle(0, {**cycle.channels, "i_q": i + 0.3 * i * np.abs(i)}))
    best, *_ = search(more, AT, on_paper.everywhere(more))
    assert best.effect == "quadratic in current"
    assert best.starts[0]["term1.coefficient"] == pytest.approx(0.3 * on_paper.K_T, rel=0.1)


def test_a_line_is_said_by_its_order_and_on_a_linear_axis_by_its_length():
    values = {"coefficient": 0.3, "order": 4.5, "frequency": 0.0, "is_friction": 0.0, "current_power": 1.0}
    shared = {**values, "speed_power": 0.0, "angle_width": 0.0, "time_width": 0.0}
    term = SimpleNamespace(effect="angle line", free=(SimpleNamespace(name="term1.coefficient"),))
    point = {f"term1.{name}": value for name, value in shared.items()}
    rotary, linear = (said(plant, [term], point) for plant in (ROTARY, LINEAR))
    assert rotary["terms"][0]["sentence"] == (
        "torque varies by 0.3 N m per ampere with 4.5 periods per turn, no whole number: no part of the motor itself"
    )
    assert rotary["orders"] == [4.5]
    assert rotary["depends_on"] == ["angle", "current"]
    assert "once in 1.4 m" in linear["terms"][0]["sentence"]
    whole = said(ROTARY, [term], point | {"term1.order": 5.0})
    assert "no whole number" not in whole["terms"][0]["sentence"]
    assert "as a torque constant does that ripples with the angle" in whole["terms"][0]["sentence"]
    assert said(ROTARY, [], {}) == {"terms": [], "orders": [], "frequencies": [], "depends_on": []}


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_what_bends_a_torque_without_a_name_is_no_cause_of_its_own(support, seed):
    """A cushion of two slopes has no law here; a pendulum that takes what ten polynomials leave of it is its form."""
    strange = support("strange")
    axis = strange.Axis()
    plant = AxisPlant(RotaryAxis.model_validate(strange.plant(axis)), [strange.record("cushion", axis, seed)])
    found = plant.balance
    sure = {term.law.name for term in found.terms if found.of_set(term) >= 0.5}
    assert sure <= {"position_torque", "spring_load", "stiffening_spring"}


@pytest.mark.parametrize("seed", [6, 7, 8])
def test_what_bends_a_drag_that_blows_one_way_is_no_sure_cause(support, seed):
    """A fan's drag has no law here: a constant load or a Stribeck curve takes what one by direction leaves of it."""
    strange = support("strange")
    axis = strange.Axis()
    plant = AxisPlant(RotaryAxis.model_validate(strange.plant(axis)), [strange.record("one_way_fan", axis, seed)])
    sure = {term.law.name for term in plant.balance.terms if plant.balance.of_set(term) >= 0.9}
    assert sure <= {"viscous_by_direction", "quadratic_drag"}
    assert sure
