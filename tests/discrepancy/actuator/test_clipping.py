"""A recorder that cuts the currents of each cycle off at its own level: seen, simulated, no flaw of the actuator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ema.core.names import CURRENTS
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import examine
from ema.discrepancy.actuator.fitting.fit import excess_at
from ema.discrepancy.actuator.reading.clipping import ranges
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant

K3 = 0.05


def clipped(cycle, share):
    """A cycle whose currents are cut off at what a share of their samples exceeds, and where that is. [A]"""
    top = float(np.quantile(np.abs([cycle[name] for name in CURRENTS]), 1.0 - share))
    return {name: np.clip(x, -top, top) if name in CURRENTS else x for name, x in cycle.items()}, top


def prepared(plant, cycles):
    return prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(cycles)))])


@pytest.fixture(scope="module")
def cycles(hidden):
    """Two of each motion, with a short of a phase and a slower filter of the recorder."""
    return hidden.cycles(hidden.Flaws(k3=K3, corner=1500.0), 4, 6)


@pytest.mark.parametrize("share", [0.01, 0.03])
def test_each_cycles_own_range_is_seen(cycles, shipped_plant, share):
    made, tops = zip(*[clipped(cycle, share) for cycle in cycles], strict=True)
    step = shipped_plant.sensors.adc_step
    assert prepared(shipped_plant, made).ranges == pytest.approx(tops, abs=step)


def test_only_the_cycles_that_are_clipped_have_one(cycles, shipped_plant):
    made = [
        clipped(cycle, share)[0] if share else cycle for cycle, share in zip(cycles, (0, 0.01, 0.05, 0), strict=True)
    ]
    assert np.isfinite(prepared(shipped_plant, made).ranges).tolist() == [False, True, True, False]


@pytest.mark.parametrize("plant", ["light", "heavy"])
@pytest.mark.parametrize("seed", range(3))
def test_currents_that_nothing_cuts_off_have_none(hidden, shipped_plant, plant, seed):
    rng = np.random.default_rng(seed)
    nominal = hidden.PLANTS[plant]
    bench = hidden.drawn_bench(rng)._replace(nominal=nominal)
    made = hidden.cycles(hidden.Flaws(), 4, seed, hidden.drawn_motions(rng, nominal.GR), bench)
    signals = [np.stack([cycle[name] for name in CURRENTS])[None] for cycle in made]
    assert np.isinf(ranges([Currents(i) for i in signals], shipped_plant.sensors.adc_step)).all()


class Currents:
    """Of one cycle; what else a cycle has says nothing of a range."""

    def __init__(self, i):
        self.i = i


def test_one_range_of_all_cycles_is_left_to_the_effect_of_the_converter(cycles, shipped_plant):
    top = clipped(cycles[0], 0.02)[1]
    made = [{n: np.clip(x, -top, top) if n in CURRENTS else x for n, x in cycle.items()} for cycle in cycles]
    assert np.isinf(prepared(shipped_plant, made).ranges).all()


def test_the_truth_leaves_noise_only_if_it_is_clipped_as_the_record_is(cycles, shipped_plant):
    data = prepared(shipped_plant, [clipped(cycle, 0.01)[0] for cycle in cycles])
    truth = {"k3": K3, "current_filter.change": 2000.0 / 1500.0 - 1.0}
    plant = EmaPlant(shipped_plant, data, 1)
    assert excess_at(plant, Noise(plant, truth), truth, range(4)) < 1.5
    without = EmaPlant(shipped_plant, replace(data, ranges=np.full(4, np.inf)), 1)
    assert excess_at(without, Noise(without, truth), truth, range(4)) > 20.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "flaws", [pytest.param({}, id="nothing", marks=pytest.mark.further), pytest.param({"corner": 1500.0}, id="filter")]
)
def test_a_clipped_record_has_no_other_cause_for_that(hidden, shipped_plant, flaws):
    made = [clipped(cycle, 0.01)[0] for cycle in hidden.cycles(hidden.Flaws(k3=K3, **flaws), 4, 6)]
    findings = examine(shipped_plant, prepared(shipped_plant, made)).findings
    assert [e.name for e in findings.effects] == ["current_filter"] * bool(flaws)
    assert findings.verdict == ("explained" if flaws else "adequate")
    assert findings.gain.k_after == pytest.approx((0.0, 0.0, K3, 0.0, 0.0, 0.0), abs=3e-3)
    assert any("clipped at" in note for note in findings.notes)
