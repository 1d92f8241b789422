"""A law of the balance is named beside what free runs found only where it is missing with that in the model."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.axis.finding.plant import AxisPlant
from ema.discrepancy.axis.judging.agreeing import merge
from ema.discrepancy.axis.judging.beside import balance_beside
from ema.discrepancy.axis.judging.named_laws import find_missing, name_laws
from ema.discrepancy.findings import FoundEffect
from ema.models.axis_config import RotaryAxis


@pytest.fixture(scope="module")
def geared(support):
    return support("geared")


def plant_of(geared, spoil=None, **hidden):
    axis = geared.Axis(**hidden)
    record = geared.record(axis, 1, seconds=8.0)
    plant = AxisPlant(RotaryAxis.model_validate(geared.plant(axis)), [spoil(record) if spoil else record], n_threads=1)
    plant.between = "held"
    return plant


def found(name):
    return FoundEffect(name, 0.99, (), {}, name, "a record")


def named(effects):
    return {name for e in effects for name in (e.name, *e.indistinguishable_from)}


def test_what_a_saturating_motor_does_not_give_is_no_friction_by_load(geared):
    plant = plant_of(geared, saturation=0.2)
    alone, _ = merge(plant, [], "unexplained", {})
    assert "quadratic_load_friction" in named(alone)  # what the balance takes it for
    point = {"F_d": geared.Axis().F, "saturation.emf": 0.2}
    beside, added = merge(plant, [found("saturation")], "partly explained", point)
    assert named(beside) == {"saturation"}
    assert balance_beside(plant, point).terms == ()
    assert added is None


def test_a_law_that_is_there_too_is_named_beside_it(geared):
    plant = plant_of(geared, saturation=0.2, dry_slope=0.04)
    point = {"F_d": geared.Axis().F, "saturation.emf": 0.2}
    beside, added = merge(plant, [found("saturation")], "partly explained", point)
    assert named(beside) == {"saturation", "friction_slope"}
    assert added is not None


def test_a_law_of_the_balance_is_missing_until_something_stands_for_it(geared):
    plant = plant_of(geared, dry_slope=0.04)
    terms = find_missing(plant.balance, [])
    (effect,) = name_laws(plant, plant.balance, terms)
    assert effect.name == "friction_slope"
    assert effect.sentence.endswith("(shown by the balance along the measured motion, not by free runs)")
    assert all(q.low <= q.value <= q.high for q in effect.parameters.values())
    assert find_missing(plant.balance, [found("friction_slope")]) == []
    assert find_missing(plant.balance, [found("saturation")]) == terms


def test_sensors_are_undone_before_the_balance_is_asked(geared):
    """A clock that is 4 % off, late channels and a crooked angle: friction and inertia are the true ones again."""

    def spoil(record):
        (c,) = record.cycles
        t, theta, w = (c[name] for name in ("t", "theta_m", "w_m"))
        theta = theta + 0.02 * np.sin(theta)
        theta, w = (np.interp(t - late, t, x) for late, x in ((3e-3, theta), (2e-3, w)))
        return Record((Cycle(0, {**c.channels, "t": t / 1.04, "theta_m": theta, "w_m": w}),))

    plant = plant_of(geared, spoil)
    true = geared.Axis()
    point = {
        "F_d": true.F, "clock_skew.rate": 0.04, "position_delay.time": 3e-3 / 1.04, "speed_delay.time": 2e-3 / 1.04,
        "resolver_error.once_sine": 0.02, "resolver_error.once_cosine": 0.0,
    }  # fmt: skip
    crooked, straight = plant.balance, balance_beside(plant, point)
    at = [b.corrected.coefficients[b.model.base.index("inertia")] / true.J for b in (crooked, straight)]
    assert abs(at[0] - 1.0) > 0.05
    assert at[1] == pytest.approx(1.0, abs=0.01)
    assert straight.terms == ()
    assert straight.left == pytest.approx(straight.noise, rel=0.1)
    assert crooked.left > 2.0 * straight.left
