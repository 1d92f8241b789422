"""Two coupled axes: inertias, coupling, gravity and friction of both, of a pendulum that another simulation swings."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.ruling import rule_by_balance
from ema.models.axis_config import RotaryAxis

WIDE = 1.5  # half intervals of 95 %: nine numbers are asked for


@pytest.fixture(scope="module")
def arm(support):
    pendulum = support("double_pendulum")

    def of(seed=1, **hidden):
        build = pendulum.Arm(**hidden)
        out, plants = {}, {}
        for name, side, record in zip(
            ("shoulder", "elbow"), ("outer", "inner"), pendulum.records(build, seed), strict=True
        ):
            plant = AxisPlant(RotaryAxis.model_validate(pendulum.plant(side)), [record])
            out[name], plants[name] = describe(plant.balance, linear=False), plant
        return out, pendulum.truth(build), plants

    return of


def off(q, truth):
    """Distance from the truth, in half intervals."""
    return abs(q["value"] - truth) / (0.5 * (q["high"] - q["low"]))


@pytest.mark.slow
def test_rigid_body_terms_of_both_joints_are_those_of_the_arm(arm):
    found, truth, plants = arm()
    for name in ("shoulder", "elbow"):
        (links,) = found[name]["given"]
        asked = {k: q for k, q in links["parameters"].items() if not k.startswith("phase")}
        assert all(off(q, truth[k]) < WIDE for k, q in asked.items()), (name, asked)
        assert all(q["value"] == pytest.approx(truth[k], rel=0.1) for k, q in asked.items())
        base = found[name]["base"]
        assert base["inertia"]["value"] == pytest.approx(truth[name], rel=0.05)
        assert base["dry_friction"]["value"] == pytest.approx({"shoulder": 0.1, "elbow": 0.08}[name], rel=0.25)
        assert found[name]["terms"] == []
        assert found[name]["explained"]["fitted"] > 0.97
        said = rule_by_balance(
            plants[name], SimpleNamespace(verdict="unexplained")
        )  # of free runs, which know no neighbour
        assert [e.name for e in said.effects] == ["linked_axis"]
        assert said.effects[0].confidence > 0.9
        assert not said.effects[0].in_every_record  # the axis model has no neighbour
        assert "neighbouring axis" in said.note


def test_friction_on_the_sum_of_both_speeds_is_named(arm):
    found, _, plants = arm(on_sum=0.3)
    term = {t["name"]: t for t in found["elbow"]["terms"]}["coupled_friction"]
    assert "sum" in term["sentence"]
    assert term["confidence"] > 0.9
    assert term["parameters"]["dry"]["value"] == pytest.approx(0.3, rel=0.2)
    said = rule_by_balance(plants["elbow"], SimpleNamespace(verdict="unexplained"))
    assert [e.name for e in said.effects] == ["linked_axis", "coupled_friction"]
    assert said.rest == 0.0 or said.rest == said.left.residual.rest  # of the balance, not of free runs


def test_free_runs_that_know_no_neighbour_are_asked_for_no_cause(arm):
    _, _, plants = arm()
    plant = plants["elbow"]
    blocks = range(len(plant.blocks))
    assert plant.candidates({}, blocks) == plant.structure({}, blocks) == []
