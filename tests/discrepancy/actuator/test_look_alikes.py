"""What can do as well as the effect that was found first, where the fit is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import strata
from ema.core.names import FAULTS
from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.examine import split
from ema.discrepancy.actuator.finding.screening import find_look_alikes, rank_to_first_order
from ema.discrepancy.actuator.fitting.candidates import Line, candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Search
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant


def recorded(hidden, trial, n_cycles, seed):
    """A trial's record as the search has it, the faults that are in it, and each effect as a candidate."""
    k = {name: x for name, x in zip(FAULTS, trial.k, strict=True) if x}
    made = hidden.cycles(hidden.Flaws(**trial.values, **k), n_cycles, seed, trial.motions, trial.bench)
    data = prepare(trial.actuator, [Record(tuple(Cycle(n, c) for n, c in enumerate(made)))])
    return EmaPlant(trial.actuator, data, 1), k, {c.effect: c for c in candidates(trial.actuator, data, [])}


@pytest.mark.further
@pytest.mark.slow
def test_a_load_is_asked_where_a_spring_does_the_same_around_one_place(hidden):
    """On a light actuator, where differences of runs are mostly noise: of what is the same, they show nine tenths."""
    trial = strata.drawn("three effects", 2, 2557375145)
    plant, k, of = recorded(hidden, trial, 6, 75145)
    late, inertia, spring = of["comparator_delay"], of["inertia"], of["spring_load"]
    frees = (*K_FREE, *late.frees, *inertia.frees)
    true = {**k, "comparator_delay.time": trial.values["reaction"], "inertia.change": trial.values["inertia"]}
    search = Search(plant, Noise(plant, true), *split(plant.data))
    before = search.model((late, inertia), frees, true, None, 2)
    best = search.model((late, inertia, spring), (*frees, *spring.frees), before.fit.point, None, 4)
    assert best.excess < 0.1
    assert best.fit.point["spring_load.stiffness"] * 0.0255 == pytest.approx(trial.values["load"], rel=0.1)
    search.noise = Noise(plant, best.fit.point)
    screened = rank_to_first_order(search, before)
    alike = find_look_alikes(search, before, best, screened, {"spring_load"}, only_there=True)
    assert {s.candidate.effect for s in alike} == {"constant_load", "asymmetric_friction"}


@pytest.mark.slow
def test_it_is_asked_beside_what_acts_too_and_not_at_the_nominal_point(hidden):
    """Beside grease that doubles the currents a load at the nominal point was like nothing: a spring was sure, 0.99."""
    trial = strata.drawn("two effects", 1, 4083970632)
    plant, k, of = recorded(hidden, trial, 4, 70632)
    drag, spring = of["viscous_drag"], of["spring_load"]
    frees = (*K_FREE, *drag.frees)
    true = {**k, "viscous_drag.coefficient": trial.values["viscous"]}
    search = Search(plant, Noise(plant, true), *split(plant.data))
    before = search.model((drag,), frees, true, None, 2)
    best = search.model((drag, spring), (*frees, *spring.frees), before.fit.point, None, 6)
    assert best.excess < 0.2
    alike = find_look_alikes(search, before, best, rank_to_first_order(search, before), set(), only_there=True)
    assert {s.candidate.effect for s in alike} >= {"constant_load", "asymmetric_friction"}


@pytest.fixture(scope="module")
def everything(shipped_plant, hidden):
    """Each effect as a candidate, by name."""
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in enumerate(hidden.cycles(hidden.Flaws(), 2))))])
    return {c.effect: c for c in candidates(shipped_plant, data, [])}


def test_a_commutation_is_tried_whatever_it_promises_where_the_zeros_lie_apart_by_more_than_a_step(
    shipped_plant, hidden
):
    """Beside shorts that have moved in its place a start that is right promises next to nothing."""
    made = enumerate(hidden.cycles(hidden.Flaws(), 2))
    data = prepare(shipped_plant, [Record(tuple(Cycle(n, c) for n, c in made))])
    for zero, is_seen in ((3e-5, True), (1e-6, False)):
        of = {c.effect: c for c in candidates(shipped_plant, replace(data, zero=zero), [])}
        assert of["commutation_offset"].is_seen == is_seen
        assert len(of["commutation_offset"].shown_starts()) == is_seen


def test_probes_of_any_size_are_as_many_as_their_columns(everything):
    line = Line("cogging", (), {"order": 6.0}, ("amplitude",), (0.02,))
    assert line.sized(np.array([0.03, -0.04])).amounts == pytest.approx([0.05 / 2**0.5] * 2)
    found = [*everything.values(), line]
    assert len(found) > 20
    for c in found:
        sized = c.sized(-0.3 * c.amounts)
        assert len(sized.amounts) == len(sized.probes()) == len(c.amounts)
        assert np.all(sized.amounts != 0.0)
        assert sized.probe_name(0) == c.probe_name(0)


def test_probes_are_made_as_long_as_what_they_are_to_do(everything):
    """A second probe goes to the side, and as far, as the first one says."""
    of = everything
    load = of["constant_load"].sized(np.array([-0.4]))
    assert load.amounts == pytest.approx([-0.4])
    assert load.probes() == [{"constant_load.torque": -0.4}]
    magnet = of["magnet_flux"].sized(np.array([-0.5]))
    assert magnet.frees == of["magnet_flux"].frees
    assert magnet.amounts[0] < 0.0
    low, _ = magnet.limits()
    assert of["magnet_flux"].sized(10.0 * low).amounts == pytest.approx(low)
    assert of["comparator_delay"].sized(np.array([-1e-6])).amounts == pytest.approx([1e-6])  # it is never early
