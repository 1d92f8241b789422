"""Along the valley of a pair: differences with the product held, steps that follow it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.actuator.fitting.fit import columns, step_to
from ema.discrepancy.actuator.fitting.free import free
from ema.discrepancy.actuator.fitting.valley import pairs
from ema.effects import registry
from ema.effects.base import Effect

COMPLIANCE, INERTIA, DAMPING = (f"gear_compliance.{name}" for name in ("compliance", "inertia", "damping"))
FREES = (free(COMPLIANCE, 2e-5), free(INERTIA, 0.09), free(DAMPING, 0.01))
POINT = {COMPLIANCE: 2e-5, INERTIA: 0.6, DAMPING: 0.05}


def test_an_inertia_goes_along_the_valley_where_the_compliance_can_follow():
    assert pairs([COMPLIANCE, INERTIA, DAMPING]) == {INERTIA: COMPLIANCE}
    assert pairs([INERTIA, DAMPING]) == {}


def test_a_pair_of_no_parameters_is_refused():
    flux = registry()["magnet_flux"]
    with pytest.raises(ValueError, match="inertia"):
        Effect("flux", flux.parameters, flux.sentence, flux.separated_by, product=("inertia", "change"))


def test_a_step_ends_at_the_product_that_first_order_says():
    """20 % less of one and 20 % more of the other: no change to first order, 4 % of the product by two steps."""
    there = step_to(POINT, FREES, np.array([4e-6, -0.12, 0.01]))
    assert there[COMPLIANCE] * there[INERTIA] == pytest.approx(2e-5 * 0.6)
    assert (there[INERTIA], there[DAMPING]) == pytest.approx((0.48, 0.06))
    alone = step_to(POINT, FREES, np.array([4e-6, 0.0, 0.0]))
    assert alone[COMPLIANCE] == pytest.approx(2.4e-5)
    least = step_to(POINT, FREES, np.array([-2e-5, -0.12, 0.0]))
    assert least[COMPLIANCE] == 0.0  # within bounds


class Ringing:
    """A plant whose features are a resonance, felt strongly, and an inertia; every run of a point has its own noise."""

    first = (0,)

    def means(self, points, cycles, n_seeds, seed):
        rng = np.random.default_rng(5)

        def features(p):
            x, J = np.log(p[COMPLIANCE] * p[INERTIA]), p[INERTIA]
            return np.array([2e4 * x, 10.0 * J, p[DAMPING]]) + 3.0 * rng.standard_normal(3)

        return [dict.fromkeys(cycles, features(p)) for p in points]


def test_what_an_inertia_does_along_the_valley_is_not_hidden_by_what_its_columns_have_in_common():
    found = columns(Ringing(), FREES, POINT, [0])
    ratio = POINT[COMPLIANCE] / POINT[INERTIA]
    along = found[0, INERTIA] - ratio * found[0, COMPLIANCE]  # J one more, C less by so much that the product stays
    assert along[0] * 0.09 == pytest.approx(0.0, abs=15.0)  # noise of a difference; either column: 3 000
    assert abs(found[0, INERTIA][0] * 0.09) > 2e3
    assert along[1] * 0.09 == pytest.approx(0.9, abs=15.0)


def test_columns_without_a_pair_are_differences():
    plant = SimpleNamespace(
        first=(0,), means=lambda points, cycles, n, seed: [{0: np.array([3.0 * p.get("k1", 0.0)])} for p in points]
    )
    k1 = SimpleNamespace(name="k1", low=0.0, high=1.0, step=0.03)
    assert columns(plant, [k1], {"k1": 0.1}, [0])[0, "k1"] == pytest.approx([3.0])
