"""Sensors that read alike too low, or a weaker magnet, beside shorts that are alike: hardly felt by a record."""

from __future__ import annotations

import numpy as np
import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.comparators import take_step, tell_step
from ema.discrepancy.actuator.fitting.fit import fit, residuals_at, stacked_jacobian
from ema.discrepancy.actuator.fitting.flat import settle
from ema.discrepancy.actuator.fitting.free import K_FREE, free
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.reading.gear import find_resonance, start_swinging
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

GAINS = {"gain_a": 0.007, "gain_b": -0.027, "gain_c": -0.014}
CHANGE = "magnet_flux.change"
K = {"k3": 0.028, "k5": 0.03}
OFF = 0.006  # of shorts and gains, against each other


@pytest.mark.slow
def test_shorts_and_gains_are_told_apart_and_the_intervals_say_how_well(hidden, shipped_plant):
    cycles = hidden.cycles(hidden.Flaws(**GAINS, **K), 3, 4, (hidden.chirp(), hidden.sine(8e-3, 5.0, 0.5)))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data)
    truth = {f"current_gain.{name}": value for name, value in GAINS.items()} | {name: K.get(name, 0.0) for name in K}
    start = {name: value + (OFF if name in K else -OFF) for name, value in truth.items()} | {"k4": OFF}
    noise = Noise(plant, start)
    frees = (*K_FREE, *(free(f"current_gain.{name}", 0.02) for name in GAINS))
    every = [0, 1, 2]
    found = settle(plant, noise, fit(plant, noise, frees, start, every, n_iterations=2), every)
    for name, value in truth.items():
        assert abs(found.point[name] - value) < min(OFF, 2.0 * found.sd[name])  # nearer than it began
    for name, value in K.items():
        assert 2.0 * found.sd[name] < value  # shorts are still told from none


@pytest.mark.slow
def test_an_inertia_behind_a_gear_that_gives_is_felt_beside_its_resonance(hidden, shipped_plant):
    """The columns of compliance and inertia nearly cancel; their difference was ten times what a change makes."""
    C, J, damper = 2.4e-5, 0.6, 30.0
    cycles = hidden.cycles(hidden.Flaws(compliance=C, user_damping=damper, k2=0.02, k3=0.03), 2, 5)
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    gear = find_resonance(shipped_plant, data)
    plant, every = EmaPlant(shipped_plant, start_swinging(data, gear), resonance=gear), [0, 1]
    name = "gear_compliance.{}".format
    start = {"k2": 0.02, "k3": 0.03, name("compliance"): C, name("inertia"): J}
    start[name("damping")] = 0.5 * damper * np.sqrt(C / J)
    frees = (*K_FREE, *(free(name(n), 0.15 * start[name(n)]) for n in ("compliance", "inertia", "damping")))
    noise = Noise(plant, start)
    found = settle(plant, noise, fit(plant, noise, frees, start, every, n_iterations=2), every)
    assert abs(found.point[name("inertia")] - J) < max(3.0 * found.sd[name("inertia")], 0.005 * J)

    def along_valley(share: float):
        at = found.point
        return {
            **at,
            name("inertia"): at[name("inertia")] * (1.0 + share),
            name("compliance"): at[name("compliance")] / (1.0 + share),
        }

    low, high = (along_valley(share) for share in (-0.03, 0.03))
    left = [np.concatenate([r[c] for c in every]) for r in residuals_at(plant, noise, [low, high], every, 32)]
    made = left[0] - left[1]
    for fitted in (fit(plant, noise, frees, found.point, every, n_iterations=1), found):
        way = np.array([high.get(f.name, 0.0) - low.get(f.name, 0.0) for f in frees])
        said = stacked_jacobian(noise, frees, fitted.columns, every) @ way
        assert np.linalg.norm(said - made) < 1.2 * np.linalg.norm(made)


@pytest.mark.further
@pytest.mark.slow
def test_a_weaker_magnet_is_found_behind_the_minima_between(hidden, shipped_plant):
    """What pattern the currents run through changes all along: steps downhill end in a minimum on the way."""
    flux, k, off = -0.04, {"k1": 0.065, "k3": 0.075, "k4": 0.05, "k5": 0.075}, 0.045
    bench = hidden.BENCH._replace(substeps=200)
    cycles = hidden.cycles(hidden.Flaws(flux=flux, **k), 4, 5, bench=bench)
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])
    plant = EmaPlant(shipped_plant, data)
    take_step(plant, tell_step(plant, Noise(plant, k), {**k, CHANGE: flux}, [0, 1]))
    start = {CHANGE: flux - off, **{name: x - (0.0 if name == "k1" else off) for name, x in k.items()}}
    noise, every = Noise(plant, start), [0, 1, 2, 3]
    begun = fit(plant, noise, (*K_FREE, free(CHANGE, 0.03)), start, every, n_iterations=2)
    found = settle(plant, noise, begun, every)
    assert abs(begun.point[CHANGE] - flux) > 0.5 * off
    assert abs(found.point[CHANGE] - flux) < 0.1 * off
