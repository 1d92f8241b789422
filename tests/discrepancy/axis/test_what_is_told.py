"""Found effects and agreements of records in words, with intervals; noise in the regressors undone; pictures."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import on_paper
import pytest
from balance_on_paper import PLAIN, J, motion, rows

from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.records.attenuation import attenuation
from ema.discrepancy.axis.balance.records.course import courses
from ema.discrepancy.axis.balance.records.integrated import integrate_rows as rows_of
from ema.discrepancy.axis.balance.records.of_records import plain_of
from ema.discrepancy.axis.balance.records.widths import half_widths
from ema.discrepancy.axis.balance.regressing.agreement import agreements
from ema.discrepancy.axis.balance.regressing.regression import regress
from ema.discrepancy.axis.balance.telling.telling import sentences
from ema.discrepancy.axis.balance.telling.telling_records import by_record
from ema.discrepancy.axis.finding.describe import effects
from ema.discrepancy.axis.naming.naming import line
from ema.discrepancy.axis.telling.pictures import pictures
from ema.discrepancy.plant import Candidate, Free
from ema.models.axis_config import LinearAxis, RotaryAxis

MOTOR = {"J": 1e-4, "F_d": 0.01, "k_t": 0.05, "p": 7, "slots": 12}
ROTARY = SimpleNamespace(plant=RotaryAxis.model_validate(MOTOR))
LINEAR = SimpleNamespace(plant=LinearAxis(motion="linear", M=1.0, F_d=1.0, drive="force"))


def free(*names):
    return tuple(Free(name, "", -1.0, 1.0, 0.0, 0.1) for name in names)


def cogging(*orders):
    names = [line(n, part) for n in orders for part in ("cos", "sin")]
    return Candidate("cogging", "cogging", free(*names), ())


DRAG = Candidate("viscous_drag", "viscous_drag", free("viscous_drag.coefficient"), ())


def test_an_interval_holds_the_middle_of_the_draws():
    drawn = [{"viscous_drag.coefficient": x} for x in np.linspace(1.0, 3.0, 401)]
    (entry,) = effects(ROTARY, [DRAG], {"viscous_drag.coefficient": 2.0}, drawn)
    q = entry["parameters"]["coefficient"]
    assert (q["value"], q["low"], q["high"]) == pytest.approx((2.0, 1.05, 2.95))
    assert q["unit"] == "N m s/rad"
    assert entry["name"] == "viscous_drag"


def test_without_draws_there_is_no_interval_and_without_effects_nothing_is_said():
    (entry,) = effects(ROTARY, [DRAG], {"viscous_drag.coefficient": 2.0}, [])
    q = entry["parameters"]["coefficient"]
    assert q["low"] == q["value"] == q["high"]
    assert effects(ROTARY, [], {}, []) == []
    nameless = replace(DRAG, is_structure=True)
    assert effects(ROTARY, [nameless], {"viscous_drag.coefficient": 2.0}, []) == []


def test_draws_that_have_the_effect_of_another_kind_say_nothing_of_a_size_that_they_have_not():
    skew = Candidate("clock_skew by a constant time", "clock_skew", free("clock_skew.late"), ())
    drawn = [{"clock_skew.rate": 0.001}, {"clock_skew.late": 1e-4}, {"clock_skew.late": 3e-4}]
    (entry,) = effects(ROTARY, [skew], {"clock_skew.late": 2e-4}, drawn)
    q = entry["parameters"]["late"]
    assert 1e-4 <= q["low"] < q["value"] < q["high"] <= 3e-4


def test_a_phase_near_half_a_turn_has_a_narrow_interval():
    rng = np.random.default_rng(0)
    drawn = [{line(12, "sin"): -1.0, line(12, "cos"): x} for x in 0.05 * rng.standard_normal(400)]
    (entry,) = effects(ROTARY, [cogging(12)], {line(12, "sin"): -1.0, line(12, "cos"): 0.0}, drawn)
    q = entry["parameters"]["phase"]
    assert abs(q["value"]) == pytest.approx(np.pi)
    assert q["high"] - q["low"] == pytest.approx(4.0 * 0.05, rel=0.2)
    assert q["low"] < q["value"] < q["high"]


@pytest.mark.parametrize(
    ("order", "also"), [(1, ["unbalance"]), (7, ["current_offset"]), (14, ["current_gain"]), (12, None)]
)
def test_what_else_makes_a_line_of_this_order_stands_beside_it(order, also):
    (entry,) = effects(ROTARY, [cogging(order)], {line(order, "cos"): 0.2, line(order, "sin"): 0.0}, [])
    assert entry.get("also") == also
    assert "0.2 N m" in entry["sentence"]
    torque = SimpleNamespace(plant=RotaryAxis.model_validate({**MOTOR, "drive": "torque"}))
    (entry,) = effects(torque, [cogging(order)], {line(order, "cos"): 0.2, line(order, "sin"): 0.0}, [])
    assert entry.get("also") == (also if order == 1 else None)  # no current is measured there


def test_each_line_is_an_effect_and_one_of_a_hundredth_of_the_strongest_is_none():
    point = {line(12, "cos"): 0.2, line(12, "sin"): 0.0, line(24, "cos"): 0.1, line(24, "sin"): 0.0}
    point |= {line(36, "cos"): 0.002, line(36, "sin"): 0.0}
    told = effects(ROTARY, [cogging(12, 24, 36)], point, [])
    assert [e["parameters"]["order"]["value"] for e in told] == [12.0, 24.0]


def test_a_linear_axis_is_told_in_metres():
    (entry,) = effects(LINEAR, [DRAG], {"viscous_drag.coefficient": 2.0}, [])
    assert entry["parameters"]["coefficient"]["unit"] == "N s/m"
    assert "rad" not in entry["sentence"]


def inertia_error():
    """Deviation of the inertia that the noise makes in one record, exactly: 300 means beside friction and drag."""
    m = motion()
    every = (m.a, m.direction, m.w, m.w * np.abs(m.w))
    a, *others = (x[:3000].reshape(300, 10).mean(axis=1) for x in every)
    beside = np.column_stack(others)
    left = a - beside @ np.linalg.lstsq(beside, a, rcond=None)[0]
    return 2e-3 / np.linalg.norm(left)


def of_two_records(torque):
    m = motion()
    found = replace(rows(m, torque(m), noise=2e-3), known={})
    (law,) = (law for law in laws(m, linear=False) if law.key == "quadratic drag")
    return agreements(found, PLAIN, regress(found, PLAIN, [law]))


def told_of(torque, linear=False):
    told = by_record(of_two_records(torque), ("one", "two"), linear=linear)
    return {entry["name"]: entry for entry in told}


def test_records_that_agree_say_so_and_of_each_coefficient():
    told = told_of(lambda m: 2e-3 * m.w * np.abs(m.w))
    assert set(told) == {"inertia", "dry_friction", "viscous_drag", "quadratic_drag"}
    assert all(entry["agree"] for entry in told.values())
    entry = told["quadratic_drag"]
    assert entry["shown_by"] == ["one", "two"]
    assert "the records agree" in entry["sentence"]
    for name in ("one", "two"):
        (q,) = entry["records"][name].values()
        assert q["low"] < 2e-3 < q["high"]
        assert q["high"] - q["low"] < 1e-3
    for name in ("one", "two"):
        q = told["inertia"]["records"][name]["value"]
        assert q["low"] < J < q["high"]
        assert q["high"] - q["low"] == pytest.approx(4.0 * inertia_error(), rel=0.5)
    assert told_of(lambda m: 0.0 * m.w, linear=True)["inertia"]["records"]["one"]["value"]["unit"] == "kg"


def test_a_law_that_one_record_has_is_seen_in_that_alone():
    entry = told_of(lambda m: np.where(m.record == 0, 5e-3, 0.0) * m.w * np.abs(m.w))["quadratic_drag"]
    assert not entry["agree"]
    assert entry["shown_by"] == ["one"]
    assert "seen in one only, and two would show it" in entry["sentence"]


def test_of_one_record_nothing_is_compared():
    m = replace(motion(), record=np.zeros(6000, int), records=("one",))
    found = replace(rows(m), record=np.zeros(600, int))
    assert by_record(agreements(found, PLAIN, regress(found, PLAIN, [])), ("one",), linear=False) == []


def corrected_of(times):
    cycle = on_paper.cycle(noise=times)
    plant = on_paper.plant(replace(cycle, channels={n: cycle[n] for n in ("t", "theta_m", "i_q")}))
    own = courses(plant)
    halves = {name: 0.006 for name in half_widths(own)}  # narrow, so that noise is felt
    plain = plain_of(plant.plant)
    found = rows_of(plant, own, halves)
    model = regress(found, plain, [])
    return model, attenuation(own, lambda noisier: rows_of(plant, noisier, halves), plain, model)


def test_what_noise_takes_from_the_inertia_is_given_back():
    model, corrected = corrected_of(6.0)
    raw, undone = model.coefficients[0], corrected.coefficients[0]
    assert raw < 0.97 * on_paper.J
    assert abs(undone - on_paper.J) < 0.5 * abs(raw - on_paper.J)
    assert corrected.covariance[0, 0] > model.covariance()[0, 0]  # the correction is not sure


def test_without_noise_nothing_is_given_back():
    model, corrected = corrected_of(0.1)
    assert corrected.coefficients[0] == pytest.approx(model.coefficients[0], rel=1e-3)


@pytest.mark.slow
def test_a_report_of_an_axis_shows_each_record_and_what_the_model_lacks():
    plant = on_paper.plant(on_paper.cycle(), on_paper.cycle(seed=2))
    outcome = SimpleNamespace(base=["F_d"], k_before=[2.0 * on_paper.F_D], point={"F_d": on_paper.F_D})
    shown = pictures(plant, outcome)
    assert [p.title for p in shown][:3] == ["0", "1", "What the model lacks"]
    assert all(p.png.startswith(b"\x89PNG") for p in shown)
    same = pictures(plant, SimpleNamespace(base=["F_d"], k_before=[on_paper.F_D], point={"F_d": on_paper.F_D}))
    assert same[0].png != shown[0].png  # before is drawn, too


@pytest.mark.parametrize(("err", "says_little"), [(0.6, True), (0.012, False)])
def test_a_balance_by_which_free_runs_go_wrong_says_so_before_its_numbers(err, says_little):
    drag = {"value": -6e-4, "low": -7e-4, "high": -5e-4, "unit": "N m s/rad", "plant_file": 2e-5}
    drag["implausible"] = "drag cannot be negative"
    of = {
        "unit": "N m",
        "explained": {"fitted": 0.999, "with_laws": 0.999},
        "base": {"viscous_drag": drag},
        "terms": [],
        "left_rms": 1e-3,
        "noise_rms": 1e-3,
        "free_run": {"err": err, "noise_floor": 0.001, "answer": 0.01},
    }
    said = sentences(of)
    assert said[0].startswith("The balance says little here: free runs with its numbers miss 60.00%") == says_little
    assert any("cannot be negative" in text for text in said) != says_little
