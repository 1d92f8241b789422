"""Maps of torque over one turn: lines, another zero, a neighbour's lines that turn round, and their pictures."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.balance.records.course import courses
from ema.discrepancy.axis.balance.records.own_zeros import add_zeros
from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.external import add_external
from ema.discrepancy.axis.reading.measured import Zero
from ema.discrepancy.axis.telling import balance_pictures
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def maps(support):
    return support("angle_map")


@pytest.fixture(scope="module")
def bench(maps):
    def of(*records, **plant):
        return AxisPlant(RotaryAxis.model_validate(maps.plant(**plant)), records)

    return of


def zeros_of(plant):
    return {c.record: c.zero for c in add_zeros(plant, courses(plant))}


def test_every_line_of_one_turn_is_found_with_its_size(maps, bench):
    found = describe(bench(maps.record(maps.OWN + maps.NEIGHBOUR, 1)).balance, linear=False)
    assert found["explained"]["with_laws"] > 0.99
    lines = {q["order"]["value"]: q["amplitude"] for q in (term["parameters"] for term in found["terms"])}
    for amplitude, n, _ in maps.OWN + maps.NEIGHBOUR:
        assert lines[n]["value"] == pytest.approx(amplitude, rel=0.03)


def test_a_map_of_friction_alone_shows_no_line(maps, bench):
    assert describe(bench(maps.record((), 1)).balance, linear=False)["terms"] == []


@pytest.mark.parametrize("F_d", [3.5e-3, 1e-2])
def test_another_zero_is_what_lays_the_lines_over_each_other(maps, bench, F_d):
    lines = maps.OWN + maps.NEIGHBOUR
    plant = bench(maps.record(lines, 1), maps.record(lines, 2, zero=0.031), F_d=F_d)
    assert zeros_of(plant) == {"record 1": 0.0, "record 2": pytest.approx(0.031, abs=1e-3)}


def test_what_turns_round_is_a_neighbour_s_and_no_other_zero(maps, bench):
    plant = bench(maps.record(maps.OWN + maps.NEIGHBOUR, 1), maps.record(maps.OWN + maps.turned(maps.NEIGHBOUR), 2))
    assert zeros_of(plant) == {"record 1": 0.0, "record 2": 0.0}
    found = {e.parameters["order"].value: e for e in add_external(plant, [])}
    assert sorted(found) == [14.0, 28.0]
    assert all(e.name == "external_torque" and e.indistinguishable_from == () for e in found.values())
    assert found[14.0].parameters["amplitude"].value == pytest.approx(6e-3, rel=0.03)  # from one to the other
    assert "turns round" in found[14.0].sentence


@pytest.mark.parametrize("hidden", [True, False])
def test_pictures_show_what_the_laws_take_of_the_residual(maps, bench, monkeypatch, hidden):
    monkeypatch.setattr(balance_pictures, "picture", lambda *parts: parts)
    plant = bench(maps.record(maps.OWN if hidden else (), 1))
    over_time, left = balance_pictures.balance_pictures(plant.balance, linear=False)
    (axes,) = over_time[2].axes
    assert axes.get_title(loc="left") == "record 1"
    measured, *made = (np.asarray(line.get_ydata()) for line in axes.lines)
    miss = [float(np.std(measured - one)) for one in made]
    assert len(miss) == 1 + hidden
    assert miss[-1] == pytest.approx(maps.NOISE, rel=0.1)
    assert ("the black line" if hidden else "no law was found") in left[1]
    assert left[2].axes[0].get_xlabel() == "position [rad]"
    assert len(left[2].axes) == 4


def test_a_zero_that_rests_on_a_wrong_plant_file_is_found_by_the_balance(maps, bench, monkeypatch):
    """What dry friction of the plant file leaves may move a line; free runs begin from the better zero."""
    monkeypatch.setattr("ema.discrepancy.axis.finding.plant.zeros", lambda _: {"record 2": Zero(-0.0082, (36.0, 72.0))})
    plant = bench(maps.record(maps.OWN, 1), maps.record(maps.OWN, 2))
    assert plant.zeros["record 2"].angle == 0.0
