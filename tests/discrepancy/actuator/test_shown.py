"""What the residual torque itself shows, a line or a tight stretch, is where a fit of it begins."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import strata
from benchmarks.strata import as_actuator
from ema.core.names import FAULTS
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import examine, split
from ema.discrepancy.actuator.finding.screening import rank_to_first_order
from ema.discrepancy.actuator.fitting.search import Search, start_model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant


@pytest.fixture(scope="module")
def screened(hidden):
    """Of a light rotor with two shorts: what each candidate leaves of the squared residual, and where it begins."""

    def screen(**flaws):
        nominal = hidden.PLANTS["light"]
        rng = np.random.default_rng(11)
        motions = tuple(hidden.drawn_motion(rng, nominal.GR) for _ in range(6))
        flawed = hidden.Flaws(k2=0.07, k3=0.06, **flaws)
        made = hidden.cycles(flawed, 6, 7, motions, hidden.Bench(nominal=nominal))
        plant = as_actuator(nominal)
        data = prepare(plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(made)))])
        simulated = EmaPlant(plant, data, 1)
        search = Search(simulated, Noise(simulated, {}), *split(data))
        model = start_model(search, {})
        cost = sum(float(r @ r) for r in model.fit.residuals.values())
        return [(s.candidate.effect, s.promised / cost, s.start) for s in rank_to_first_order(search, model)]

    return screen


@pytest.mark.slow
def test_cogging_beside_a_dead_time_begins_with_its_order_amplitude_and_phase(screened):
    """A column simulated without the dead time is out of phase: another order promised more, a tenth of the cost."""
    name, left, start = screened(cogging=5e-3, cogging_order=36.0, cogging_phase=-1.4, dead_time=2.2e-6)[0]
    assert name == "cogging"
    assert left < 0.5
    assert start["cogging.order"] == pytest.approx(36.0, abs=0.11)
    assert start["cogging.amplitude"] == pytest.approx(5e-3, rel=0.1)


@pytest.mark.slow
def test_a_tight_stretch_begins_with_its_place_and_height(screened):
    found = screened(bump=1.5, bump_centre=5e-4, bump_width=1e-3)
    name, left, start = found[0]
    assert name == "position_friction"
    assert left < 0.5
    assert start["position_friction.centre"] == pytest.approx(5e-4, abs=3e-4)


@pytest.mark.further
@pytest.mark.slow
def test_a_commutation_that_the_zeros_show_is_named_beside_offsets_and_drag(hidden):
    trial = strata.drawn("three effects", 2, 3249995962)
    assert set(trial.told["effects"]) == {"current_offset", "commutation_offset", "quadratic_drag"}
    k = {name: x for name, x in zip(FAULTS, trial.k, strict=True) if x}
    made = hidden.cycles(hidden.Flaws(**trial.values, **k), 6, 95962, trial.motions, trial.bench)
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    found = {e.name: e for e in examine(trial.actuator, prepare(trial.actuator, [record])).findings.effects}
    assert found.keys() == set(trial.told["effects"])
    told = found["commutation_offset"].parameters["angle"].value
    assert told == pytest.approx(trial.values["commutation"], rel=0.1)
