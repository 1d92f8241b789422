"""Comparators that turn where a current leaves its band: what is simulated does not hang on the step."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import switching
from benchmarks.switching import FAULTS, common_difference
from ema.models import hf

N_RUNS = 32
FINE = 2.5e-7  # [s]


def local_means(plant, **how):
    return switching.local_means(plant, N_RUNS, n_threads=2, **how)


@pytest.fixture(scope="module")
def fine(shipped_plant):
    return local_means(shipped_plant, located=True, dt=FINE)


@pytest.mark.parametrize("dt", [1e-6, 2e-6])
def test_what_currents_do_on_average_does_not_hang_on_the_step(shipped_plant, fine, dt):
    assert common_difference(local_means(shipped_plant, located=True, dt=dt), fine) < 2e-3


def test_comparators_asked_once_a_step_come_to_the_same_with_fine_steps(shipped_plant, fine):
    asked = {dt: common_difference(local_means(shipped_plant, dt=dt), fine) for dt in (FINE, 1e-6)}
    assert asked[1e-6] > 8e-3
    assert asked[FINE] < 0.6 * asked[1e-6]


def test_energy_is_kept_over_every_turn_within_a_step(shipped_plant):
    r = hf.simulate(shipped_plant, FAULTS, located=True, dt=2e-6, audited=True)
    E = {name: float(x[0]) for name, x in r.energy.items()}
    asked = hf.simulate(shipped_plant, FAULTS, audited=True).energy
    balance = E["E_electric"] - E["E_copper"] - E["E_shaft"]
    assert abs(balance) < 2e-3 * E["E_electric"]  # and what the inductances hold at the end
    assert E["E_electric"] == pytest.approx(float(asked["E_electric"][0]), rel=0.02)


def test_a_run_is_the_same_wherever_it_stands_in_a_batch(shipped_plant):
    some, others = (
        hf.simulate(shipped_plant, np.tile(FAULTS, (len(seeds), 1)), seeds=np.array(seeds), located=True, dt=2e-6).i
        for seeds in ([0, 1, 2], [1, 5])
    )
    assert np.array_equal(some[1], others[0])


def test_a_sensor_that_reads_too_much_moves_the_band(shipped_plant):
    effects = {"current_gain": {f"gain_{phase}": 0.25 for phase in "abc"}}
    known = hf.simulate(shipped_plant, np.zeros(6), effects=effects, located=True, noise=False)
    asked = hf.simulate(shipped_plant, np.zeros(6), effects=effects, dt=FINE, noise=False)
    some, other = (np.abs(r.i).mean() for r in (known, asked))
    assert some == pytest.approx(other, rel=0.01)


LATE = [
    {"comparator_delay": {"time": 2.3e-6}},
    {"dead_time": {"time": 1.7e-6}},
]


@pytest.mark.parametrize("effects", LATE, ids=lambda e: next(iter(e)))
def test_legs_that_follow_late_do_so_by_their_own_time_and_not_the_step_s(shipped_plant, effects):
    some, fine = (local_means(shipped_plant, located=True, dt=dt, effects=effects) for dt in (1e-6, FINE))
    none = local_means(shipped_plant, located=True, dt=FINE)
    assert common_difference(some, fine) < 0.3 * common_difference(none, fine)


@pytest.mark.parametrize("effects", LATE, ids=lambda e: next(iter(e)))
def test_legs_that_follow_late_are_those_of_comparators_asked_often(shipped_plant, effects):
    some = local_means(shipped_plant, located=True, dt=1e-6, effects=effects)
    asked, none = (local_means(shipped_plant, dt=1.25e-7, effects=of) for of in (effects, {}))
    assert common_difference(some, asked) < 0.5 * common_difference(none, asked)


def test_a_supply_sags_under_what_the_legs_draw(shipped_plant):
    sag = {"supply_sag": {"resistance": 1.0, "capacitance": 2e-3}}
    some, asked = (
        hf.simulate(shipped_plant, FAULTS, noise=False, effects=sag, located=located, dt=dt).u_dc[0]
        for located, dt in ((True, 1e-6), (False, 1.25e-7))
    )
    below = shipped_plant.inverter.V_dc - asked
    assert below.max() > 1.0
    assert some == pytest.approx(asked, abs=0.05 * below.max())
