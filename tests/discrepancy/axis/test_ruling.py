"""The balance gives the verdict where free runs cannot say, and only there."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType, SimpleNamespace

import pytest

from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.ruling import rule_by_balance
from ema.discrepancy.grade import LIMIT, grade
from ema.models.axis_config import RotaryAxis

QUIET = {"noise": 0.01, "spikes": 0.0, "speed_noise": 0.01}


@pytest.fixture(scope="module")
def short_pendulum(support) -> ModuleType:
    return support("short_pendulum")


def plant_of(module, **hidden):
    build = module.Pendulum(**hidden)
    return AxisPlant(RotaryAxis.model_validate(module.plant(build)), [module.record(build, 2)])


FITTED = {"J": 0.14, "F_d": 0.25, "C": 0.02}  # as free runs would


def as_free_runs_had(verdict, noise=0.5, missed=0.5, rest=1.0, named=(), nameless=None):
    """As free runs of which noise makes a part of the motion, and that miss one, with a rest of so many times noise.

    `nameless` is what they leave with a torque that has no name.
    """
    left = SimpleNamespace(residual=SimpleNamespace(rest=rest), allowed=LIMIT)
    folds = SimpleNamespace(noise_floor=noise, err_after=missed)
    effects = [{"name": name} for name in named]
    structure = {} if nameless is None else {"terms": ["a torque at 25 Hz"]}
    return SimpleNamespace(
        verdict=verdict, point=FITTED, folds=folds, left=left, effects=effects, structure=structure, rest=nameless
    )


def test_a_law_that_free_runs_are_blind_to_is_named_by_the_balance_which_says_so(short_pendulum):
    plant = plant_of(short_pendulum)
    said = rule_by_balance(plant, as_free_runs_had("adequate"))
    assert [e.name for e in said.effects] == ["pendulum"]
    assert "not of free runs" in said.note
    assert grade(said.left, named=True) in ("explained", "partly explained")


def test_free_runs_that_follow_the_motion_and_leave_noise_keep_their_verdict(short_pendulum):
    plant = plant_of(short_pendulum)
    assert [t.law.name for t in plant.balance.terms] == ["pendulum"]
    assert rule_by_balance(plant, as_free_runs_had("adequate", noise=0.01)) is None


def test_where_the_balance_needs_no_law_free_runs_keep_their_verdict(short_pendulum):
    plant = plant_of(short_pendulum, G=0.0)
    assert rule_by_balance(plant, as_free_runs_had("adequate")) is None


def test_free_runs_that_are_worse_with_a_law_refute_it(short_pendulum):
    plant, other = plant_of(short_pendulum, G=0.0, **QUIET), plant_of(short_pendulum, **QUIET)
    assert [t.law.name for t in other.balance.terms] == ["pendulum"]
    plant._balances[plant.between] = other.balance  # of another axis
    assert rule_by_balance(plant, as_free_runs_had("adequate")) is None


def test_of_an_axis_that_creeps_the_balance_speaks_where_free_runs_miss_the_motion_and_only_there(short_pendulum):
    plant = plant_of(short_pendulum)
    plant._balances[plant.between] = replace(plant.balance, creeps=0.4)
    said = rule_by_balance(plant, as_free_runs_had("explained", noise=0.01, missed=0.5))
    assert [e.name for e in said.effects] == ["pendulum"]
    assert "creeps in 40%" in said.note
    assert rule_by_balance(plant, as_free_runs_had("explained", noise=0.01, missed=0.01)) is None


def test_a_drag_that_the_file_has_as_known_is_named_where_the_balance_rules(short_pendulum):
    """The balance fits inertia and drag in any case: that they are others than the plant file's is no silence."""
    build = short_pendulum.Pendulum(G=0.0, C=0.3, **QUIET)
    known = {"J": build.J, "fitted": []}
    plant = AxisPlant(
        RotaryAxis.model_validate({**short_pendulum.plant(build), **known}), [short_pendulum.record(build, 2)]
    )
    plant._balances[plant.between] = replace(plant.balance, creeps=0.4)
    said = rule_by_balance(plant, as_free_runs_had("partly explained", noise=0.01, missed=0.5, rest=25.0))
    assert [e.name for e in said.effects] == ["viscous_drag"]
    assert said.effects[0].confidence > 0.9
    assert said.effects[0].parameters["coefficient"].value == pytest.approx(0.3, rel=0.05)


def test_a_balance_that_sees_nothing_is_no_witness_against_a_torque_by_which_free_runs_follow(short_pendulum):
    plant = plant_of(short_pendulum, G=0.0)
    plant._balances[plant.between] = replace(plant.balance, creeps=0.1)
    free_runs = {"noise": 0.01, "missed": 0.01, "rest": 25.0}
    assert rule_by_balance(plant, as_free_runs_had("unexplained", **free_runs, nameless=1.1)) is None
    assert rule_by_balance(plant, as_free_runs_had("unexplained", **free_runs, nameless=5.0)) is not None


def test_of_an_axis_that_creeps_the_balance_speaks_where_it_leaves_fewer_times_the_noise(short_pendulum):
    plant = plant_of(short_pendulum)
    plant._balances[plant.between] = replace(plant.balance, creeps=0.1)
    said = rule_by_balance(plant, as_free_runs_had("partly explained", noise=0.01, missed=0.01, rest=25.0))
    assert [e.name for e in said.effects] == ["pendulum"]
    assert rule_by_balance(plant, as_free_runs_had("partly explained", noise=0.01, missed=0.01, rest=0.5)) is None
    assert rule_by_balance(plant, as_free_runs_had("explained", noise=0.01, missed=0.01, rest=25.0)) is None


def test_free_runs_that_know_what_friction_does_before_it_slides_and_leave_little_keep_their_verdict(short_pendulum):
    plant = plant_of(short_pendulum)
    plant._balances[plant.between] = replace(plant.balance, creeps=0.1)
    rest, here = 1.15, {"noise": 0.01, "missed": 0.2}
    knows = as_free_runs_had("partly explained", **here, rest=rest, named=["friction_memory", "constant_load"])
    assert rule_by_balance(plant, knows) is None
    assert rule_by_balance(plant, as_free_runs_had("partly explained", **here, rest=rest, named=["stribeck"]))
    far = as_free_runs_had("partly explained", **here, rest=25.0, named=["friction_memory"])
    assert rule_by_balance(plant, far)


def test_free_runs_that_miss_much_of_the_motion_have_no_verdict_beside_a_balance_that_is_closer(short_pendulum):
    plant = plant_of(short_pendulum)
    assert not plant.balance.creeps
    said = rule_by_balance(plant, as_free_runs_had("partly explained", noise=0.01, missed=0.5, rest=25.0))
    assert [e.name for e in said.effects] == ["pendulum"]
    assert "they miss 50% of the motion" in said.note
    for other in ({"missed": 0.01}, {"rest": 0.5}, {"verdict": "explained"}):
        had = as_free_runs_had(**{"verdict": "partly explained", "noise": 0.01, "missed": 0.5, "rest": 25.0} | other)
        assert rule_by_balance(plant, had) is None, other
