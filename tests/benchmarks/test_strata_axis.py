"""What a frozen run of the axis hides: every effect in its turn, three plants, and what is told is true."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest

from benchmarks import frozen, frozen_axis, strata_axis, strata_laws
from ema.effects import registry

HEAD = "a" * 40
N = 200


def test_there_are_as_many_as_asked_for_and_every_effect_and_kind_has_its_turn():
    of = strata_axis.counts(N)
    assert sum(of.values()) >= N
    assert of["one effect"] >= 2 * len(strata_axis.EFFECTS)
    assert of["outside the library"] >= len(strata_axis.OUTSIDE)
    assert of["loops"] >= 6
    assert of["law, cascaded loops"] > 2 * len(strata_laws.HIDDEN)
    assert {e for e in strata_axis.EFFECTS if e not in registry()} == set()


def test_every_effect_that_an_axis_may_have_is_hidden_by_some_stratum():
    """But one that is a set with another one wherever it acts, and one of linear motors, which no stratum draws."""
    rng = np.random.default_rng(1)
    laws = [strata_laws.hidden(name, strata_laws.geared.Axis(), rng) for name in strata_laws.HIDDEN]
    effects = [h.effects for h in laws]
    hidden = {*strata_axis.EFFECTS, *(e for some in effects for e in some), "viscous_by_direction", "drive_compliance"}
    hidden |= {*strata_axis.LEARNT.values()}
    mine = {name for name, e in registry().items() if "axis" in e.plants}
    assert mine - hidden == {"encoder_error", "position_line"}
    assert all(e in registry() for e in hidden)


def test_a_dozen_kinds_are_outside_the_library_and_what_acts_like_them_is_in_it():
    assert len(strata_axis.OUTSIDE) >= 12
    assert not set(strata_axis.OUTSIDE) & set(registry())
    assert all(e in registry() for near in strata_axis.NEAR.values() for e in near)


@pytest.mark.parametrize("name", strata_laws.HIDDEN)
def test_what_is_hidden_is_in_the_record(name):
    """The record differs from that of the same axis and motion without the law: noise is the same in both."""
    import geared

    axis = geared.Axis()
    h = strata_laws.hidden(name, axis, np.random.default_rng(1))
    gravity = h.axis.gravity if "effects" in h.plant_file else 0.0
    plain = replace(axis, C=h.axis.C, warms=h.axis.warms, gravity=gravity)
    there = h.spoil(geared.record(h.others[0] if h.others else h.axis, 1, seconds=4.0)).cycles[0]
    here = geared.record(plain, 1, seconds=4.0).cycles[0]
    off = {"theta_m": there["theta_m"] - here["theta_m"], "w_m": there["w_m"] - here["w_m"]}
    off["i_q"] = (there["torque"] / axis.k_t if "torque" in there else there["i_q"]) - here["i_q"]
    noise = dict(zip(("theta_m", "w_m", "i_q"), axis.noise, strict=True))
    assert max(np.sqrt(np.mean(x**2)) / noise[channel] for channel, x in off.items()) > 0.7


def test_plants_differ_by_more_than_a_factor_of_two():
    for a, b in combinations(strata_axis.PLANTS.values(), 2):
        inertia, friction = ((x[0] * x[1], x[0]) for x in (a, b))
        assert all(max(x, y) / min(x, y) > 2.0 for x, y in zip(inertia, friction, strict=True))
        assert max(a[2], b[2]) / min(a[2], b[2]) > 2.0


@pytest.mark.parametrize("name", strata_axis.PLANTS)
def test_the_plant_file_obeys_the_motion_that_it_is_given_with(name):
    """Speed is the integral of the torque of the current, less drag and friction, over the inertia."""
    seed = next(s for s in range(99) if list(strata_axis.PLANTS)[s % 3] == name)
    t = strata_axis.drawn("nothing", 0, seed)
    p = t.plant_file
    c = max(t.records[0], key=lambda c: np.std(c["w_m"]))  # the fastest: noise of the speed counts least
    dt, w = c["t"][1], c["w_m"]
    torque, way = (np.cumsum(x) * dt for x in (p["k_t"] * c["i_q"] - p["C"] * w, np.sign(w)))
    by_torque, by_way, _ = np.linalg.lstsq(np.stack([torque, way, np.ones(len(w))], axis=1), w, rcond=None)[0]
    J, F = 1.0 / by_torque, -by_way / by_torque
    assert pytest.approx(p["J"], rel=0.05) == J
    assert p["F_d"] / 2 < F < 2 * p["F_d"]


def test_the_same_seed_makes_the_same_trial():
    a, b = (strata_axis.drawn("two effects", 3, frozen.seed(HEAD, "two effects", 3)) for _ in range(2))
    assert (a.case, a.truth) == (b.case, b.truth)
    np.testing.assert_array_equal(a.records[0].cycles[0]["i_q"], b.records[0].cycles[0]["i_q"])


@pytest.mark.parametrize("seed", range(3))
def test_on_every_plant_a_supply_sags_by_what_is_told_beside_a_drop_of_the_converter(seed, monkeypatch):
    """By u² i R / U² to first order; one flaw of the voltage does not take the other's place."""
    monkeypatch.setattr(strata_axis, "EFFECTS", ["supply_sag", "inverter_drop"])
    t = strata_axis.drawn("two effects", 0, seed)
    t = replace(t, without=cache(t.without))  # each record is simulated once
    both, sag, drop = ({k: np.concatenate([c[k] for c in t.without(but)]) for k in ("i_q", "u_q")} for but in
                       ("", "inverter_drop", "supply_sag"))  # fmt: skip
    fell = t.truth["inverter_drop.voltage"] * np.tanh(drop["i_q"] / 0.02)
    u = drop["u_q"] - fell
    first = t.truth["supply_sag.resistance"] * u**2 * sag["i_q"] / t.plant_file["V_dc"] ** 2
    assert (sag["u_q"] - u) @ first / (first @ first) == pytest.approx(1.0, abs=0.3)
    assert (both["u_q"] - sag["u_q"]) @ fell / (fell @ fell) == pytest.approx(1.0, abs=0.3)
    assert all(strata_axis.nats(t, name) > 5.0 for name in t.effects)
    assert strata_axis.nats(t, "cogging") == 0.0


def test_a_spring_that_stiffens_is_right_where_the_hidden_one_does_and_wrong_elsewhere():
    spring, drag = (
        strata_axis.drawn("one effect", strata_axis.EFFECTS.index(name), 7) for name in ("spring_load", "viscous_drag")
    )

    def named(*names):
        effects = [{"name": name, "indistinguishable_from": []} for name in names]
        return {"effects": effects, "verdict": "explained"}

    assert frozen_axis.outcome(spring, named("stiffening_spring")) == "right"
    assert frozen_axis.outcome(spring, named("spring_load")) == "right"
    assert frozen_axis.outcome(spring, named("pendulum")) == "wrong"
    assert frozen_axis.outcome(drag, named("stiffening_spring")) == "wrong"


def test_bristles_that_a_bench_has_of_its_own_may_be_named_and_nothing_else():
    setups = len(strata_axis.axis_other.SETUPS)
    nothing = next(t for n in range(9 * setups) if not (t := strata_axis.drawn("other makers", n, n)).effects)

    def named(*names, verdict="partly explained"):
        return {"effects": [{"name": n, "indistinguishable_from": []} for n in names], "verdict": verdict}

    assert frozen_axis.outcome(nothing, named("friction_memory")) == "right"
    assert frozen_axis.outcome(nothing, named("friction_memory", "stribeck")) == "wrong"
    assert frozen_axis.outcome(nothing, named(verdict="unexplained")) == "wrong"
    assert frozen_axis.outcome(nothing, named(verdict="adequate")) == "right"
