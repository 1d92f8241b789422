"""What a search has fitted before it found the cause stays in its answer; the score takes it out again."""

from __future__ import annotations

import pytest

from ema.core.records import Cycle, Record
from ema.discrepancy.actuator.fitting.candidates import candidates
from ema.discrepancy.actuator.fitting.free import K_FREE
from ema.discrepancy.actuator.fitting.search import Search, start_model
from ema.discrepancy.actuator.reading.cycles import prepare
from ema.discrepancy.actuator.scoring.entrants import weigh_sets
from ema.discrepancy.actuator.simulating.noise import Noise
from ema.discrepancy.actuator.simulating.plant import EmaPlant


@pytest.mark.slow
def test_what_was_fitted_on_the_way_to_the_cause_has_no_probability(hidden, shipped_plant):
    made = hidden.cycles(hidden.Flaws(flux=-0.06), 4, 31, motions=(hidden.chirp(duration=0.25),))
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    plant = EmaPlant(shipped_plant, prepare(shipped_plant, [record]), 2)
    search = Search(plant, Noise(plant, {}), [0, 1], [2, 3])
    before = start_model(search, {})
    first = {c.effect: c for c in reversed(candidates(shipped_plant, plant.data, ()))}
    of = [first[name] for name in ("winding_resistance", "clock_skew", "magnet_flux")]
    start = {name: x for c in of for name, x in c.probes()[0].items()}
    answer = search.model(of, (*K_FREE, *(f for c in of for f in c.frees)), start, None, 4)
    outcome, models = weigh_sets(search, before, answer)
    assert outcome.posterior[0].causes == ("magnet_flux",)
    assert outcome.posterior[0].probability > 0.9
    assert models[0].names == ("magnet_flux",)
    flux, sd = outcome.sizes("magnet_flux")["magnet_flux.change"]
    assert abs(flux + 0.06) < 3.0 * sd


@pytest.mark.slow
def test_what_is_in_the_set_that_leads_is_weighed_too(hidden, shipped_plant):
    """Sensors that read too low, found as a lighter rotor with recorder gains; with sensor gains it had led."""
    gains = {"gain_a": -0.0135, "gain_b": -0.0177, "gain_c": -0.0122}
    made = hidden.cycles(hidden.Flaws(**gains), 4, 31, motions=(hidden.chirp(duration=0.25),))
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    plant = EmaPlant(shipped_plant, prepare(shipped_plant, [record]), 2)
    search = Search(plant, Noise(plant, {}), [0, 1], [2, 3])
    before = start_model(search, {})
    first = {c.effect: c for c in reversed(candidates(shipped_plant, plant.data, ()))}

    def fit_beside_a_lighter_rotor(name):
        of = [first["inertia"], first[name]]
        frees = (*K_FREE, *(f for c in of for f in c.frees))
        return search.model(of, frees, {"inertia.change": -0.016, f"{name}.gain_b": -0.003}, None, 4)

    fit_beside_a_lighter_rotor("current_gain")
    outcome, models = weigh_sets(search, before, fit_beside_a_lighter_rotor("recorder_gain"))
    assert models[0].names == outcome.posterior[0].causes == ("current_gain",)
    assert models[0] is search.at_minimum(models[0])  # by columns of a fit on its way sizes are told too surely
    assert outcome.posterior[0].probability > 0.9
    for name, gain in gains.items():
        found, sd = outcome.sizes("current_gain")[f"current_gain.{name}"]
        assert abs(found - gain) < 3.0 * sd


@pytest.mark.slow
def test_of_two_ways_in_which_a_clock_may_be_off_the_likelier_stands_for_it(hidden, shipped_plant):
    """Whichever was fitted last: the recorder's clock alone is no rival of one that the controller shares."""
    made = hidden.cycles(hidden.Flaws(clock_skew=1e-3), 4, 31, motions=(hidden.chirp(duration=0.25),))
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    plant = EmaPlant(shipped_plant, prepare(shipped_plant, [record]), 2)
    search = Search(plant, Noise(plant, {}), [0, 1], [2, 3])
    before = start_model(search, {})
    clocks = [c for c in candidates(shipped_plant, plant.data, ()) if c.effect == "clock_skew"]
    ways = {c.linear: search.model((c,), (*K_FREE, *c.frees), c.probes()[0], None, 4) for c in clocks}
    shared, own = ways["shared",], ways["rate",]
    outcome, models = weigh_sets(search, before, shared, [own])
    assert models[0] is search.at_minimum(shared)
    assert outcome.posterior[0].causes == ("clock_skew",)
    assert outcome.posterior[0].probability > 0.9
    rate, sd = outcome.sizes("clock_skew")["clock_skew.shared"]
    assert abs(rate - 1e-3) < 3.0 * sd


@pytest.mark.slow
def test_a_fault_that_was_dropped_for_an_effect_is_weighed_as_one_that_may_be_there(hidden, shipped_plant):
    """A weaker magnet with shorts of all phases: the least was dropped, and what it had went to magnet and others."""
    k = {"k3": 0.05, "k4": 0.026, "k5": 0.031}
    made = hidden.cycles(hidden.Flaws(flux=-0.06, **k), 4, 31, motions=(hidden.chirp(duration=0.25),))
    record = Record(tuple(Cycle(n, c) for n, c in enumerate(made)))
    plant = EmaPlant(shipped_plant, prepare(shipped_plant, [record]), 2)
    search = Search(plant, Noise(plant, {}), [0, 1], [2, 3])
    before = start_model(search, {})
    c = next(c for c in candidates(shipped_plant, plant.data, ()) if c.effect == "magnet_flux")
    frees = (*(f for f in K_FREE if f.name != "k4"), *c.frees)
    start = {"magnet_flux.change": -0.085, "k3": 0.025, "k5": 0.006}
    outcome, models = weigh_sets(search, before, search.model((c,), frees, start, None, 6))
    assert models[0].names == ("magnet_flux",)
    found = {**outcome.sizes_of_faults(k), **outcome.sizes("magnet_flux")}
    for name, truth in (k | {"magnet_flux.change": -0.06}).items():
        value, sd = found[name]
        assert abs(value - truth) < 3.0 * sd, name
        assert sd < 0.02
