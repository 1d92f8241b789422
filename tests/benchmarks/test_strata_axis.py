"""What a frozen run of the axis hides: every effect in its turn, three plants, and what is told is true."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from benchmarks import frozen, strata_axis
from ema.effects import registry

HEAD = "a" * 40
N = 200


def test_there_are_as_many_as_asked_for_and_every_effect_and_kind_has_its_turn():
    of = strata_axis.counts(N)
    assert sum(of.values()) >= N
    assert of["one effect"] >= 2 * len(strata_axis.EFFECTS)
    assert of["outside the library"] >= len(strata_axis.OUTSIDE)
    assert of["loops"] >= 6
    assert {e for e in strata_axis.EFFECTS if e not in registry()} == set()


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
    c = max(t.record, key=lambda c: np.std(c["w_m"]))  # the fastest: noise of the speed counts least
    dt, w = c["t"][1], c["w_m"]
    torque, way = (np.cumsum(x) * dt for x in (p["k_t"] * c["i_q"] - p["C"] * w, np.sign(w)))
    by_torque, by_way, _ = np.linalg.lstsq(np.stack([torque, way, np.ones(len(w))], axis=1), w, rcond=None)[0]
    J, F = 1.0 / by_torque, -by_way / by_torque
    assert pytest.approx(p["J"], rel=0.05) == J
    assert p["F_d"] / 2 < F < 2 * p["F_d"]


def test_the_same_seed_makes_the_same_trial():
    a, b = (strata_axis.drawn("two effects", 3, frozen.seed(HEAD, "two effects", 3)) for _ in range(2))
    assert (a.case, a.truth) == (b.case, b.truth)
    np.testing.assert_array_equal(a.record.cycles[0]["i_q"], b.record.cycles[0]["i_q"])
