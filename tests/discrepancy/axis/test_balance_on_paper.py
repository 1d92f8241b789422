"""Laws and regression of the balance on a motion that is known on paper: no simulation, no noise but what is added."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from balance_on_paper import F_D, PLAIN, C, J, N, acting, motion, rows

from ema.discrepancy.axis.balance.laws.along import LINES
from ema.discrepancy.axis.balance.laws.drifting import drift_laws
from ema.discrepancy.axis.balance.laws.law import BY_RECORD, Law, one
from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.laws.links import links
from ema.discrepancy.axis.balance.laws.memory import memory_laws
from ema.discrepancy.axis.balance.laws.units import LINEAR, ROTARY, of_base
from ema.discrepancy.axis.balance.records.course import Course
from ema.discrepancy.axis.balance.records.sampled import join
from ema.discrepancy.axis.balance.records.widths import half_widths
from ema.discrepancy.axis.balance.regressing import choice
from ema.discrepancy.axis.balance.regressing.agreement import agreements
from ema.discrepancy.axis.balance.regressing.apart import apart, by_record
from ema.discrepancy.axis.balance.regressing.choice import choose_laws
from ema.discrepancy.axis.balance.regressing.found import Balance, draw_law
from ema.discrepancy.axis.balance.regressing.regression import regress


@pytest.mark.parametrize("linear", [False, True])
def test_every_law_has_columns_units_and_a_sentence(linear):
    m = motion()
    found = list(laws(m, linear=linear))
    assert len({law.key for law in found}) == len(found)
    for law in [*found, links(m), links(motion(neighbour="inner"))]:
        columns = law.columns(m, acting(m))
        assert len(columns) == law.n_columns, law.key
        assert all(x.shape == (N,) and np.isfinite(x).all() for x in columns), law.key
        values = law.values(np.linspace(0.3, 0.7, law.n_columns))
        assert values.keys() >= law.parameters.keys(), law.key
        assert "{" not in law.sentence.format(**values)


@pytest.mark.parametrize("neighbour", ["inner", "outer"])
def test_the_weak_form_of_linked_axes_is_the_strong_one(neighbour):
    """f + dp/dt, where the column holds accelerations."""
    m = motion(neighbour=neighbour)
    law = links(m)
    for column, (f, p) in zip(law.columns(m, acting(m)), law.weak(m), strict=True):
        assert (f + np.gradient(p, m.t))[5:-5] == pytest.approx(column[5:-5], abs=2e-3 * np.abs(column).max() + 1e-9)


ON_PAPER = ["constant", "quadratic drag", "spring", "pendulum", "line 5", "gear line 7.3", "friction_by_angle"]


@pytest.mark.parametrize("key", ON_PAPER)
def test_a_law_beside_inertia_friction_and_drag_is_fitted_to_the_last_digit(key):
    m = motion()
    (law,) = (law for law in laws(m, linear=False) if law.key == key)
    c = 0.02 * np.arange(1, law.n_columns + 1)
    found = regress(
        rows(m, torque=sum(x * column for x, column in zip(c, law.columns(m, acting(m)), strict=True))), PLAIN, [law]
    )
    assert found.coefficients[found.part(law)] == pytest.approx(c, rel=1e-6)
    assert found.coefficients[0] == pytest.approx(J, rel=1e-6)
    assert found.loss == pytest.approx(0.0, abs=1e-12)


def test_intervals_of_coefficients_hold_their_noise():
    m, truth, inside = motion(), np.array([J, F_D, C]), 0
    for seed in range(40):
        made = rows(m)
        y = made.y + F_D * (made.integrate @ m.direction) + C * (made.integrate @ m.w)
        noise = 0.05 * np.random.default_rng(seed).standard_normal(len(y))
        found = regress(replace(made, y=y + noise, known={}), PLAIN, [])
        inside += int((np.abs(found.coefficients - truth) < 2.0 * np.sqrt(np.diag(found.covariance()))).sum())
    assert 0.85 * 120 < inside <= 120  # 95 % of three coefficients in forty


def test_nothing_is_chosen_where_nothing_acts_and_a_drag_where_one_does():
    m = motion()
    every = [law for law in laws(m, linear=False) if law.family not in LINES]
    nothing = choose_laws(rows(m, noise=0.01), PLAIN, every)
    assert isinstance(nothing, Balance)
    assert nothing.terms == ()
    (term,) = choose_laws(rows(m, torque=2e-3 * m.w * np.abs(m.w), noise=0.01), PLAIN, every).terms
    assert term.law.key == "quadratic drag"
    assert term.wins > 0.95


def test_records_that_each_move_one_way_do_not_tell_friction_from_a_constant_torque():
    """Of two run-ups of a real motor friction was told as -5.002 ± 0.0005 N m in one and 5.024 in the other."""
    m = motion()
    one_way = np.where(m.record == 0, 1.0, -1.0)
    w = one_way * (20.0 + np.abs(m.w))
    friction = F_D * one_way + C * w
    m = replace(m, w=w, direction=one_way, drive=J * m.a + friction, known=J * m.a)
    made = rows(m, torque=0.03, noise=1e-4)
    (constant,) = (law for law in laws(m, linear=False) if law.key == "constant")
    fit = regress(made, PLAIN, [constant], apart=True)
    sd = np.sqrt(np.diag(fit.covariance()))
    untold = [k for k, name in enumerate((*fit.base, "constant")) if name.startswith(("dry_friction", "constant"))]
    assert len(untold) == 3
    assert (np.abs(fit.coefficients[untold]) <= 0.03).all()  # beyond the plant file's friction
    assert (sd[untold] > 0.03).all()
    found = {a.name: a for a in agreements(made, PLAIN, regress(made, PLAIN, [constant]))}
    assert found["dry_friction"].p > 0.5
    assert not any(found["dry_friction"].could)


def test_a_choice_whose_tests_go_round_ends_with_what_leaves_least(monkeypatch):
    """Four records of a real motor that only ran up made one choice go round for ever; here its revisions do."""
    m = motion()
    made = rows(m, torque=2e-3 * m.w * np.abs(m.w), noise=0.01)
    every = [law for law in laws(m, linear=False) if law.key in ("constant", "spring", "quadratic drag")]
    wrong = [regress(made, PLAIN, [law]) for law in every if law.key != "quadratic drag"]
    revised = itertools.cycle(wrong)
    monkeypatch.setattr(choice, "_revise", lambda *_: next(revised))
    (term,) = choose_laws(made, PLAIN, every).terms
    assert term.law.key == min(wrong, key=lambda r: r.loss).laws[0].key


@pytest.mark.parametrize("between", [0.0, 0.25, 0.5])
def test_a_line_along_a_travel_may_lie_between_those_that_are_tried(between):
    """Magnets of a linear motor: no whole number of them fits into a travel."""
    m = motion()
    resolution = 2.0 * np.pi / float(np.ptp(m.theta))
    order = (9.0 + between) * resolution
    made = rows(m, torque=0.05 * np.sin(order * m.theta + 1.0), noise=0.005)
    (term,) = choose_laws(made, PLAIN, list(laws(m, linear=True))).terms
    found = term.law.values(made_of(made, term.law))
    assert term.law.name == "position_line"
    assert found["order"] == pytest.approx(order, abs=resolution / 40.0)
    assert found["amplitude"] == pytest.approx(0.05, rel=0.05)


BETWEEN = [("stribeck", "speed", s) for s in (-1.0, 0.0, 0.5, 1.0)] + [("friction with memory", "deflection", 0.0)]


@pytest.mark.parametrize(("family", "key", "shape"), BETWEEN)
def test_a_law_of_a_family_of_few_may_lie_between_its_members_and_its_interval_says_so(family, key, shape):
    """The way of bristles was told as 0.11344 ± 0 rad: the member that left least was alone in its interval."""
    m = motion()
    every = [law for law in laws(m, linear=False) if law.family == family]
    own = [law for law in every if law.values(np.ones(1)).get("shape", 0.0) == np.ceil(shape)]
    truth = own[len(own) // 2].among.moved(np.array([0.4, shape - np.ceil(shape)][: len(own[0].among.at)]))
    hidden, held = truth.values(np.ones(1))[key], 0
    for seed in range(20):
        made = rows(m, torque=0.04 * truth.columns(m, acting(m))[0], noise=0.003, seed=seed)
        b = choose_laws(made, PLAIN, every)
        (term,) = b.terms
        low, high = np.quantile([law.values(c)[key] for law, c in draw_law(b, term)], (0.025, 0.975))
        assert term.law.values(np.ones(1))[key] == pytest.approx(hidden, rel=0.25)
        assert high < 1.5 * low
        held += int(low <= hidden <= high)
    assert held >= 16  # 88 to 95 % of forty are held


def made_of(made, law):
    model = regress(made, PLAIN, [law])
    return model.coefficients[model.part(law)]


def test_a_law_by_record_is_the_shared_one_cut_in_two():
    m = motion()
    shared = Law("f", "f", "f", lambda m, _: (m.w**2,), {"c": "1"}, one("c"), "{c}", "")
    own = by_record(shared, 2)
    assert own.key == "f" + BY_RECORD
    a, b = own.columns(m, acting(m))
    assert a + b == pytest.approx(m.w**2)
    assert (a * b == 0.0).all()
    assert own.values(np.array([1.0, 3.0])) == {"c": 2.0}
    found = regress(rows(m, torque=np.where(m.record == 0, 0.01, 0.03) * m.w**2), PLAIN, [own])
    assert found.coefficients[found.part(own)] == pytest.approx([0.01, 0.03], rel=1e-6)


def test_what_differs_between_records_needs_two_and_keeps_the_mean():
    m = motion()
    units = of_base(ROTARY)
    assert list(apart(replace(m, records=("one",)), [], units)) == []
    by_name = {law.name: law for law in apart(m, [], units)}
    law = by_name["dry_friction_by_record"]
    assert law.parameters == {"spread": "N m"}
    assert of_base(LINEAR)["inertia"] == "kg"
    (column,) = law.columns(m, acting(m))
    assert column == pytest.approx(np.where(m.record == 0, 1.0, -1.0) * m.direction)
    assert law.values(np.array([0.02]))["spread"] == pytest.approx(0.04)


def test_temperature_and_reversals_are_asked_for_only_where_they_are():
    m = motion()
    names = {law.name for law in drift_laws(m, "N m", "rad")}
    assert {"friction_by_temperature", "viscous_by_temperature", "magnet_flux"} <= names
    cold = {law.name for law in drift_laws(replace(m, dT=np.zeros(N)), "N m", "rad")}
    assert cold == {"friction_drift", "viscous_drift"}
    assert list(memory_laws(m, "N m", "rad"))
    one_way = replace(m, theta=m.t * 3.0, w=np.full(N, 3.0), direction=np.ones(N))
    assert list(memory_laws(one_way, "N m", "rad")) == []


def test_friction_with_memory_lacks_least_long_after_a_reversal():
    m = motion()
    law = next(iter(memory_laws(m, "N m", "rad")))
    (lacks,) = law.columns(m, acting(m))
    turned = np.flatnonzero(np.diff(m.direction) != 0.0) + 1
    assert np.abs(lacks[turned]).min() > 1.5  # friction still acts the old way
    assert np.abs(lacks[turned[1:] - 1]).max() < 0.5


def test_test_functions_are_as_wide_as_noise_wants_them():
    m = motion()
    bench = SimpleNamespace(roles=SimpleNamespace(kind="current"))

    def of(sigma):
        noisy = m.theta + sigma * np.random.default_rng(1).standard_normal(N)
        course = Course("one", bench, m.t, m.drive, noisy, None, None, m.dT, 0.0 * m.t, {"position": sigma})
        return half_widths([course])["one"]

    widths = [of(sigma) for sigma in (1e-6, 1e-3, 1e-2)]
    assert widths == sorted(widths)
    assert widths[0] < widths[-1]


def test_motions_are_joined_end_to_end():
    m = motion()
    both = join([m, m])
    assert both.w == pytest.approx(np.concatenate([m.w, m.w]))
    assert both.neighbour == "outer"
    assert join([m, replace(m, neighbour="")]).neighbour == ""


def test_a_record_at_rest_leaves_its_inertia_open():
    moving = motion()
    rests = moving.record == 1
    still = replace(moving, a=np.where(rests, 0.0, moving.a), w=np.where(rests, 0.0, moving.w))
    fit = regress(rows(still, noise=1e-4), PLAIN, [], apart=True)
    covariance = dict(zip(fit.base, np.diag(fit.covariance()), strict=True))
    at = {name: value for name, value in covariance.items() if name.startswith("inertia")}
    first, last = at.values()
    assert first > 0.0
    assert last == 0.0
    assert fit.coefficients[fit.base.index(next(reversed(at)))] == pytest.approx(0.0, abs=1e-9)
