"""Two effects that faults stand for: neither gains enough alone, and both together explain what there is."""

from __future__ import annotations

import pytest

from benchmarks import discrepancy, frozen, strata
from ema.discrepancy.actuator.cycles import prepare
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.forward import add_effects
from ema.discrepancy.actuator.free import K_FREE
from ema.discrepancy.actuator.gear import find_resonance, start_swinging
from ema.discrepancy.actuator.noise import Noise
from ema.discrepancy.actuator.plant import EmaPlant
from ema.discrepancy.actuator.screening import rank_to_first_order
from ema.discrepancy.actuator.search import Search, start_model

SEED = 1261968401  # a gear that gives, a load and a friction that grows with load; k3 = 0.053, k5 = 0.011
GEAR = {"gear_compliance.compliance": 1.2e-5, "gear_compliance.inertia": 0.8, "gear_compliance.damping": 0.06}
FAULTS = {"k1": 0.09, "k2": 0.008, "k3": 0.056, "k4": 0.076}


@pytest.mark.further
@pytest.mark.slow
def test_a_load_and_the_friction_that_grows_with_it_are_found_behind_faults_that_stood_for_both():
    a = strata.drawn("three effects", 2, SEED)
    record = discrepancy.recorded(a.values, a.k, a.n_cycles, frozen.bench_seed(SEED), a.motions, a.bench)
    data = prepare(a.actuator, [record])
    swings = find_resonance(a.actuator, data)
    plant = EmaPlant(a.actuator, start_swinging(data, swings), resonance=swings)
    search = Search(plant, Noise(plant, {}), *split(data))
    before = start_model(search, {})
    screened = rank_to_first_order(search, before)
    gear = next(s.candidate for s in screened if s.candidate.effect == "gear_compliance")
    found = search.model((gear,), (*K_FREE, *gear.frees), {**FAULTS, **GEAR}, None, 2)
    alike = [()]
    made, _ = add_effects(search, before, found, search.verdict(found), alike)
    assert set(made.names) == {"gear_compliance", "constant_load", "load_friction"}
    assert len(alike) == 3
    assert made.fit.point["load_friction.per_torque"] == pytest.approx(a.values["load_friction"], rel=0.05)
    assert made.fit.point["constant_load.torque"] == pytest.approx(a.values["load"], rel=0.05)
    assert [made.fit.point[f"k{j}"] for j in (1, 2, 3, 4)] == pytest.approx([0.0, 0.0, 0.053, 0.0], abs=4e-3)
