"""Two coupled axes: inertias, coupling, gravity and friction of both, of a pendulum that another simulation swings."""

from __future__ import annotations

import pytest

from ema.discrepancy.axis.balance.telling import told
from ema.discrepancy.axis.plant import AxisPlant
from ema.models.axis_config import RotaryAxis

WIDE = 1.5  # half intervals of 95 %: nine numbers are asked for


@pytest.fixture(scope="module")
def arm(support):
    pendulum = support("double_pendulum")

    def of(seed=1, **hidden):
        build = pendulum.Arm(**hidden)
        out = {}
        for name, side, record in zip(
            ("shoulder", "elbow"), ("outer", "inner"), pendulum.records(build, seed), strict=True
        ):
            plant = AxisPlant(RotaryAxis.model_validate(pendulum.plant(side)), [record])
            out[name] = told(plant.balance, linear=False)
        return out, pendulum.truth(build)

    return of


def off(q, truth):
    """Distance from the truth, in half intervals."""
    return abs(q["value"] - truth) / (0.5 * (q["high"] - q["low"]))


def test_rigid_body_terms_of_both_joints_are_those_of_the_arm(arm):
    found, truth = arm()
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


def test_friction_on_the_sum_of_both_speeds_is_named(arm):
    found, _ = arm(on_sum=0.3)
    term = {t["name"]: t for t in found["elbow"]["terms"]}["coupled_friction"]
    assert "sum" in term["sentence"]
    assert term["confidence"] > 0.9
    assert term["parameters"]["dry"]["value"] == pytest.approx(0.3, rel=0.2)
