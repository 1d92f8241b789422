"""A cable that stiffens is named as that, and no pendulum for what it bends; what cannot be told apart is a set."""

from __future__ import annotations

import numpy as np
import pytest

from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.agreeing import merge
from ema.discrepancy.findings import FoundEffect
from ema.effects.stiffening_spring import EFFECT, bends, tilts
from ema.models import axis
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def cable(support):
    return support("cable_bench")


def axis_of(module, seed=0, **hidden):
    bench = module.Bench(**hidden)
    return bench, AxisPlant(RotaryAxis.model_validate(module.plant(bench)), [module.record(bench, seed)])


def terms_of(plant):
    return describe(plant.balance, linear=False)["terms"]


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.further)])
def test_a_cable_that_stiffens_is_named_alone_with_its_stiffness(cable, seed):
    bench, plant = axis_of(cable, seed, cable=0.3, over=0.45)
    (term,) = terms_of(plant)
    assert term["name"] == "stiffening_spring"
    assert term["confidence"] > 0.9
    assert term["indistinguishable_from"] == []
    found = {name: q["value"] for name, q in term["parameters"].items()}
    at_the_ends = bench.cable * np.cosh(bench.span / bench.over)
    assert found["middle"] == pytest.approx(bench.cable, rel=0.05)
    assert (found["lower"], found["upper"]) == pytest.approx((at_the_ends, at_the_ends), rel=0.1)


@pytest.mark.further
def test_cogging_beside_it_is_told_and_no_pendulum(cable):
    """The bench of `docs/real-data.md` on which a pendulum was named sure, and wrong: 26 % stiffer at the ends."""
    _, plant = axis_of(cable, cable=0.3, over=1.25, lines=((0.0052, 84.0, 0.3), (0.0016, 14.0, 1.0)))
    named = {(t["name"], round(t["parameters"].get("order", {"value": 0})["value"])) for t in terms_of(plant)}
    assert named == {("stiffening_spring", 0), ("cogging", 84), ("cogging", 14)}


@pytest.mark.parametrize("span", [0.3, 0.9, 3.0])
def test_a_pendulum_of_any_swing_is_no_larger_set_for_it(cable, span):
    _, plant = axis_of(cable, G=0.5, phase=0.3, span=span)
    terms = {t["name"]: t for t in terms_of(plant)}
    assert not {"stiffening_spring", "position_torque"} & set(terms["pendulum"]["indistinguishable_from"])
    assert "stiffening_spring" not in terms


def test_a_pendulum_beside_a_straight_spring_is_found_where_the_swing_shows_it(cable):
    _, plant = axis_of(cable, G=0.5, spring=0.3, span=2.0)
    found = {t["name"]: t["parameters"] for t in terms_of(plant)}
    assert found["pendulum"]["amplitude"]["value"] == pytest.approx(0.5, rel=0.02)
    assert found["spring_load"]["stiffness"]["value"] == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("hidden", [{"G": 0.5, "spring": 0.3}, {"cable": 0.3, "over": 1.2}])
def test_where_it_swings_too_little_the_two_are_a_set_of_free_runs_too(cable, hidden):
    _, plant = axis_of(cable, seed=1, **hidden)
    (term,) = terms_of(plant)
    assert term["name"] == "stiffening_spring"
    assert "pendulum" in term["indistinguishable_from"]
    of_free_runs = FoundEffect("stiffening_spring", 0.99, (), {}, "", "")
    (found,), _ = merge(plant, [of_free_runs], "explained", {})
    assert found.indistinguishable_from == ("pendulum",)
    assert found.confidence <= 0.5
    assert found.of_set == pytest.approx(0.99)


def test_what_leaves_zero_on_one_side_only_is_no_pendulum_either(cable):
    _, plant = axis_of(cable, taut=0.4)
    assert "pendulum" not in {t["name"] for t in terms_of(plant)}
    assert plant.balance.explained(plant.balance.left) > 0.99


def test_nothing_is_named_where_nothing_pulls(cable):
    assert terms_of(axis_of(cable)[1]) == []


def test_the_simulated_torque_has_the_stiffness_that_is_said(cable):
    plant = RotaryAxis.model_validate(cable.plant(cable.Bench()))
    numbers = {"middle": 0.3, "lower": 0.5, "upper": 0.9, "bias": 0.02, "centre": 0.1, "half": 0.7, "over": 0.35}
    at = np.array([-0.6, 0.1, 0.8])
    zero, h = np.zeros(3), 1e-5

    def torque(theta):
        plain, pulled = (
            axis.torque_along(axis.model(plant, of), theta, zero, zero, zero, zero)
            for of in ({}, {EFFECT.name: numbers})
        )
        return plain - pulled

    assert (torque(at + h) - torque(at - h)) / (2.0 * h) == pytest.approx(
        [0.5, 0.3, 0.9], rel=h
    )  # straight beyond an end
    assert torque(at)[1] == pytest.approx(0.02)


def test_for_little_growth_it_is_a_square_and_a_cube():
    x = np.linspace(-1.0, 1.0, 11)
    assert bends(x, 0.05) == pytest.approx(x**3 / 3.0, abs=1e-4)
    assert tilts(x, 0.05) == pytest.approx(x**2 / 2.0, abs=1e-3)


@pytest.mark.parametrize("growth", [1e-3, 0.5, 3.0])
def test_far_beyond_the_travel_the_spring_goes_on_straight(growth):
    """A motor turns a thousand times while its cable was looked at on one: no number overflows there."""
    far = np.array([-7000.0, 7000.0])
    ends = np.array([-1.0, 1.0])
    np.testing.assert_allclose(bends(far, growth) - bends(ends, growth), far - ends, rtol=1e-6)
    np.testing.assert_allclose(tilts(far, growth) - tilts(ends, growth), np.abs(far) - 1.0, rtol=1e-6)
