"""Several records of one bench: what they share is fitted once; what differs, and what contradicts, is told by record.

Benches of two simulations that share no code with the library: `positioner` and `axis_other`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.discrepancy.axis.balance.regressing.agreement import _compare
from ema.discrepancy.axis.balance.telling.telling import describe, sentences
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.models.axis_config import LinearAxis, RotaryAxis

SLOW = {"motions": ((2, 0.3, 0), (1, 0.15, 1.5), (4, 0.4, -2)), "duration": 4.0, "period": 2e-3}
ORDER = 12


@pytest.fixture(scope="module")
def tables(support):
    positioner = support("positioner")

    def of(*hidden):
        records = [positioner.table(positioner.Table(**own), seed, seconds=12.0) for seed, own in enumerate(hidden, 1)]
        plant = AxisPlant(LinearAxis.model_validate(positioner.table_plant(positioner.Table())), records)
        plant.between = "held"
        return describe(plant.balance, linear=True)

    return of


@pytest.fixture(scope="module")
def spindles(support):
    """Records of a slow spindle, with a torque of order 12 of the given amplitude in each. [N m]"""
    other = support("axis_other")
    noise = {"position": 2e-4, "speed": 0.02, "drive": 0.02, "u": 0.3}
    setup = replace(other.SETUPS["spindle"], noise=noise, **SLOW)

    def of(*amplitudes):
        hidden = [np.eye(8)[other.COGGING] * size + np.eye(8)[other.ORDER] * ORDER for size in amplitudes]
        records = [other.record(replace(setup, hidden=tuple(h)), seed) for seed, h in enumerate(hidden, 1)]
        plant = AxisPlant(RotaryAxis.model_validate(other.plant(setup)), records)
        return describe(plant.balance, linear=False), plant

    return of


def by_name(found):
    return {own["name"]: own for own in found["by_record"]}


def values(entry, name="value"):
    return [q[name]["value"] for q in entry["records"].values()]


def test_records_that_agree_are_fitted_once_and_nothing_is_made_up(tables):
    found = tables({}, {})
    assert found["terms"] == []
    records = by_name(found)
    assert set(records) == {"inertia", "dry_friction", "viscous_drag"}
    assert all(own["agree"] and own["p"] > 0.001 for own in records.values())


def test_friction_of_a_warmer_record_is_told_by_record_beside_what_both_share(tables):
    found = tables({}, {"F_d": 30.0})
    (term,) = found["terms"]
    assert term["name"] == "dry_friction_by_record"
    assert term["confidence"] > 0.9
    records = by_name(found)
    assert values(records["dry_friction"]) == pytest.approx([20.0, 30.0], rel=0.01)
    assert "temperature" in records["dry_friction"]["sentence"]
    assert records["inertia"]["agree"]
    assert found["base"]["inertia"]["value"] == pytest.approx(90.0, rel=0.01)


def test_a_load_in_one_record_is_its_own_and_no_contradiction(tables):
    records = by_name(tables({}, {"constant": -6.0}))
    assert values(records["constant_load"], "torque") == pytest.approx([0.0, -6.0], abs=0.1)
    assert records["constant_load"]["shown_by"] == ["record 2"]
    assert records["dry_friction"]["agree"]


def test_cogging_that_all_records_show_is_one_line(spindles):
    found, _ = spindles(0.05, 0.05)
    (term,) = found["terms"]
    assert (term["name"], term["confidence"] > 0.9) == ("cogging", True)
    assert by_name(found)["cogging"]["agree"]


@pytest.mark.parametrize(
    ("sizes", "said"), [((0.05, 0.09), "contradict each other"), ((0.05, 0.0), "seen in record 1 only")]
)
def test_cogging_that_differs_between_records_counts_against_it(spindles, sizes, said):
    found, _ = spindles(*sizes)
    entry = by_name(found)["cogging"]
    assert not entry["agree"]
    assert entry["p"] < 1e-4
    assert values(entry, "amplitude") == pytest.approx(sizes, abs=0.002)
    assert said in entry["sentence"]
    assert "record 1" in entry["sentence"]
    (term,) = found["terms"]
    assert term["confidence"] < 0.1
    assert "contradict" in sentences(found)[0]


def test_a_line_that_turns_round_is_no_shift_of_the_zero_alone(spindles):
    found, plant = spindles(0.05, -0.05)
    zero = plant.zeros["record 2"]
    assert (zero.angle, zero.turned) == (0.0, (12.0,))
    assert abs(zero.instead) == pytest.approx(np.pi / ORDER, abs=0.01)
    assert "contradict" in by_name(found)["cogging"]["sentence"]


def test_the_test_of_agreement_is_right_as_often_as_it_says():
    """Two records, values of two columns, the covariance known but for what 20 blocks tell."""
    rng = np.random.default_rng(0)
    rare = []
    for _ in range(400):
        V = np.diag([1.0, 4.0, 2.0, 1.0])
        samples = rng.multivariate_normal([5.0, 0.0, 5.0, 0.0], V, 20)
        covariance = np.cov(samples.T) / 20
        a = _compare("line", None, samples.mean(axis=0).reshape(2, 2), covariance, 20, needed=False)
        rare.append(a.p < 0.05)
    assert 0.03 < np.mean(rare) < 0.09


@pytest.mark.parametrize("last", [1.02, 0.0])
def test_a_record_that_cannot_show_a_coefficient_neither_agrees_nor_contradicts(last):
    """As a standstill the inertia, whichever record it is."""
    values = np.array([[1.0], [1.02 - last], [last]])
    V = np.diag(np.where(values.ravel() == 0.0, 0.0, 1e-4))
    a = _compare("inertia", None, values, V, 20, needed=False)
    sees = tuple(values.ravel() != 0.0)
    assert (a.shown, a.could) == (sees, sees)
    assert a.is_one(1)
    assert a.p > 0.05
