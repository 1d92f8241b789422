"""What warms up, bends and meshes in a geared axis (tests/support/geared.py): named, and nothing made up."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.balance.laws.laws import laws
from ema.discrepancy.axis.balance.records.of_records import balance
from ema.discrepancy.axis.balance.telling.as_effects import point
from ema.discrepancy.axis.balance.telling.telling import describe
from ema.discrepancy.axis.finding.between import examine_ways
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.finding.screened import begin_at
from ema.discrepancy.fitting import fit
from ema.discrepancy.plant import Candidate, Free
from ema.models.axis_config import RotaryAxis

WARM_UP = (22.0, 58.0, 4.0)


@pytest.fixture(scope="module")
def geared(support) -> ModuleType:
    return support("geared")


def plant_of(geared, *, temperature=False, seconds=12.0, more=(), **hidden):
    axis = geared.Axis(**hidden)
    model = RotaryAxis.model_validate(geared.plant(axis, **dict(more)))
    plant = AxisPlant(model, [geared.record(axis, 1, temperature=temperature, seconds=seconds)])
    plant.between = "held"
    return plant


def laws_of(geared, **how):
    return {term["name"]: term for term in describe(balance(plant_of(geared, **how)), linear=False)["terms"]}


def test_nothing_hidden_needs_none_of_these_laws_though_it_warms_up(geared):
    assert laws_of(geared, warms=WARM_UP, temperature=True) == {}


def test_friction_with_memory_is_named_with_the_angle_over_which_it_builds_up_and_free_runs_follow(geared):
    plant = plant_of(geared, bristle=0.15)
    b = balance(plant)
    (law,) = describe(b, linear=False)["terms"]
    assert law["name"] == "friction_memory"
    assert law["confidence"] > 0.9
    assert law["indistinguishable_from"] == []
    assert law["parameters"]["deflection"]["value"] == pytest.approx(0.15, rel=0.2)
    with_it = point(b, linear=False)
    without = {**with_it, "friction_memory.deflection": 0.0}
    after, before = (plant.errors(p, range(len(plant.blocks))) for p in (with_it, without))
    assert after.error < 0.2 * before.error


def test_dry_friction_that_falls_with_a_recorded_temperature_is_named_by_it_and_not_by_time(geared):
    (law,) = laws_of(geared, dry_per_kelvin=0.012, warms=WARM_UP, temperature=True).values()
    assert law["name"] == "friction_by_temperature"
    assert law["confidence"] > 0.9
    k, F = (law["parameters"][name]["value"] for name in ("per_kelvin", "at_20_celsius"))
    assert k * F == pytest.approx(0.012 * 0.03, rel=0.1)


def test_viscous_friction_of_an_activation_energy_is_that_of_reynolds_exponential(geared):
    (law,) = laws_of(geared, C=1.5e-3, viscous_activation=3000.0, warms=WARM_UP, temperature=True).values()
    assert law["name"] == "viscous_by_temperature"
    assert law["confidence"] > 0.9
    k, C = (law["parameters"][name]["value"] for name in ("per_kelvin", "at_20_celsius"))
    lost = np.exp(3000.0 * (1.0 / 331.15 - 1.0 / 293.15))
    assert 1.5e-3 - C * (1.0 - np.exp(-38.0 * k)) == pytest.approx(1.5e-3 * lost, rel=0.1)


def test_magnets_that_weaken_as_they_warm_up_are_told_from_friction_that_does(geared):
    (law,) = laws_of(geared, flux_per_kelvin=-0.0012, warms=(22.0, 110.0, 4.0), temperature=True).values()
    assert law["name"] == "magnet_flux"
    assert law["confidence"] > 0.9
    assert law["parameters"]["per_kelvin"]["value"] == pytest.approx(-0.0012, rel=0.1)


@pytest.mark.parametrize(
    ("hidden", "name", "change"),
    [
        ({"dry_rate": -0.04}, "friction_drift", -0.04 * 12.0 * 0.03),
        ({"viscous_rate": -0.04, "C": 1.5e-3}, "viscous_drift", -0.04 * 12.0 * 1.5e-3),
    ],
)
def test_friction_that_drifts_without_a_temperature_is_a_drift(geared, hidden, name, change):
    (law,) = laws_of(geared, **hidden).values()
    assert law["name"] == name
    assert law["confidence"] > 0.9
    assert law["parameters"]["change"]["value"] == pytest.approx(change, rel=0.03)


def test_friction_that_grows_with_the_square_of_the_motor_torque_is_named_where_there_is_no_load(geared):
    (law,) = laws_of(geared, by_square=2.5).values()
    assert law["name"] == "quadratic_load_friction"
    assert law["parameters"]["per_torque"]["value"] == pytest.approx(2.5, rel=0.05)


def test_a_law_is_found_though_another_takes_more_where_it_happens_to_act(geared):
    """In a hard start friction takes nearly all of the torque: a share of the load does so too, in two blocks of 54."""
    axis = geared.Axis(F=0.02754, J=1.094e-4, by_square=4.179)
    made = geared.record(axis, 69663, seconds=8.0, size=1.39)
    plant = AxisPlant(RotaryAxis.model_validate(geared.plant(axis)), [made])
    plant.between = "held"
    (term,) = balance(plant).terms
    assert term.law.key == "friction by square of motor"


def test_a_law_that_takes_all_that_is_more_than_noise_is_needed_though_it_is_small_beside_the_drive(geared):
    """Less than a hundredth of the drive's torque; without it 16 times what noise makes is left, with it noise."""
    b = balance(plant_of(geared, F=0.0365, by_square=1.5, seconds=8.0))
    (term,) = b.terms
    assert term.law.family == "friction by square of load"
    assert term.power < 3e-4 * b.drive
    assert b.left_base > 10.0 * b.noise
    assert b.left < 1.2 * b.noise


PLANETARY = {"gear": 6.0, "gear_kind": "planetary", "teeth": (17, 85)}
HARMONIC = {"gear": 100.0, "gear_kind": "harmonic"}


@pytest.mark.parametrize(
    ("gear", "order", "name", "others"),
    [
        (PLANETARY, 17.0 * 85.0 / 102.0, "gear_error", []),
        (PLANETARY, 12.0, "cogging", []),
        (HARMONIC, 2.0, "gear_error", ["cogging"]),  # two lobes, or a stator that is oval
        ({}, 2.0, "cogging", []),
    ],
)
def test_a_torque_at_an_order_of_the_declared_gear_is_the_gear_s(geared, gear, order, name, others):
    (law,) = laws_of(geared, more=gear, lines=((0.006, order, 0.7),), seconds=6.0).values()
    assert law["name"] == name
    assert law["confidence"] > 0.9
    assert law["indistinguishable_from"] == others
    assert law["parameters"]["amplitude"]["value"] == pytest.approx(0.006, rel=0.02)
    assert law["parameters"]["order"]["value"] == pytest.approx(order, rel=1e-4)


def test_a_line_between_two_motor_orders_is_none_of_the_gear_where_no_gear_is_declared(geared):
    assert "gear_error" not in laws_of(geared, lines=((0.006, 17.0 * 85.0 / 102.0, 0.7),), seconds=6.0)


@pytest.mark.slow
def test_a_torque_channel_that_reads_too_much_is_named_or_in_a_set_where_inertia_is_known(geared):
    """All of the drive's torque is 15 % too large: inertia, friction and drag would be, too."""
    axis = geared.Axis(C=6e-4)
    (cycle,) = geared.record(axis, 1, seconds=4.0)
    channels = {name: x for name, x in cycle.channels.items() if name != "i_q"}
    record = Record((Cycle(0, {**channels, "torque": 1.15 * axis.k_t * cycle["i_q"]}),))
    model = {"kind": "axis", "drive": "torque", "J": axis.J, "F_d": axis.F, "C": axis.C}
    (found,) = examine_ways(AxisPlant(RotaryAxis.model_validate(model), [record])).effects
    assert found["name"] == "drive_gain"
    assert len(found["indistinguishable_from"]) <= 1
    assert found["parameters"]["gain"]["value"] == pytest.approx(0.15, abs=0.005)


def test_each_window_has_the_temperature_of_its_own_time(geared):
    windows = plant_of(geared, warms=WARM_UP, temperature=True, seconds=6.0).windows
    dT = np.array([w.dT for w in windows])
    expected = [2.0 + 36.0 * (1.0 - np.exp(-w.t.mean() / 4.0)) for w in windows]
    np.testing.assert_allclose(dT, expected, atol=0.5)


def test_without_a_load_there_is_nothing_that_friction_by_load_could_grow_with(geared):
    """What rounding leaves of a load is none: scaled up, it had been a law with a share of 1e16."""
    model = balance(plant_of(geared, seconds=6.0)).model
    m = model.rows.motion
    (held,) = (law for law in laws(m, linear=False) if law.key == "friction by held")
    (column,) = held.columns(m, model.acting)
    assert not column.any()


def test_what_is_held_beside_a_fitted_parameter_is_told_with_it(geared):
    """Here the share per kelvin is fitted, and the friction that it is a share of is not."""
    share = Free("viscous_by_temperature.per_kelvin", "1/K", -0.1, 0.1, 0.02, 0.01, 1e-3)
    held = {"viscous_by_temperature.coefficient": 0.006}
    c = Candidate("viscous_by_temperature", "viscous_by_temperature", (share,), ({**held, share.name: 0.02},))
    at = {**held, share.name: 0.058}
    (entry,) = plant_of(geared, seconds=2.0).describe(
        [c], at, lambda n: [{**at, share.name: 0.058 + d} for d in (-1e-3, 1e-3)]
    )
    assert entry["parameters"]["per_kelvin"]["value"] == 0.058
    assert entry["parameters"]["coefficient"]["value"] == 0.006
    assert "5.80%" in entry["sentence"]


def test_free_runs_find_the_friction_that_a_share_per_kelvin_is_of(geared):
    """Held where the balance had it, 16 % off, a record needed a drive that reads 19 % too much beside it."""
    C, activation = 2e-3, 4500.0
    plant = plant_of(geared, C=C, viscous_activation=activation, warms=(20.0, 56.0, 2.0), temperature=True, seconds=8.0)
    law = begin_at("viscous_by_temperature", {"per_kelvin": 0.06, "coefficient": 0.8 * C}, {}, 6.0)
    gain = Free("drive_gain.gain", "1", -0.5, 0.5, 0.0, 0.01)
    free, blocks = [*plant.base, *law.free], list(range(len(plant.blocks)))
    found = fit(plant, free, {**{f.name: f.start for f in plant.base}, **law.starts[0]}, blocks)
    beside = fit(plant, [*free, gain], {**found.point, gain.name: 0.0}, blocks)
    assert beside.scale > 0.99 * found.scale
    k, C_20 = (found.point[f"viscous_by_temperature.{name}"] for name in ("per_kelvin", "coefficient"))
    lost = C * (1.0 - np.exp(activation * (1.0 / 329.15 - 1.0 / 293.15)))
    assert C_20 * (1.0 - np.exp(-36.0 * k)) == pytest.approx(lost, rel=0.1)  # the hidden law is Arrhenius'
