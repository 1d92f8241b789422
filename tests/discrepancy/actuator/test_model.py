"""Fitted models: what is said of them, what is taken out of them, and when an effect is no credible one."""

from __future__ import annotations

import pytest

from ema.discrepancy.actuator.finding.weighing import is_alike, is_credible, is_enough, is_something
from ema.discrepancy.actuator.fitting.candidates import Candidate
from ema.discrepancy.actuator.fitting.fit import Fit
from ema.discrepancy.actuator.fitting.free import K_FREE, free
from ema.discrepancy.actuator.fitting.model import Model, free_again, strip


def candidate(name: str) -> Candidate:
    f = free(name)
    return Candidate(name.split(".")[0], (f,), {}, (name.split(".")[1],), (f.step,))


FLUX, DRAG = candidate("magnet_flux.change"), candidate("viscous_drag.coefficient")


def model(*effects: Candidate, heldout: float = 2.0, **point: float) -> Model:
    named = {name.replace("__", "."): x for name, x in point.items()}
    frees = (*K_FREE, *(f for c in effects for f in c.frees))
    return Model(effects, Fit(named, frees, {}, {}, heldout, dict.fromkeys(named, 0.01)), heldout)


def test_a_misfit_below_one_leaves_nothing():
    assert model(heldout=0.9).excess == 0.0
    assert model(heldout=1.4).excess == pytest.approx(0.4)


def test_a_magnet_stands_for_shorts_of_all_phases_together_and_drag_for_none():
    alike = {"k3": 0.05, "k4": 0.05, "k5": 0.05}
    assert model(**alike).shows_faults_of(FLUX)
    assert not model(**alike | {"k5": 0.0}).shows_faults_of(FLUX)
    assert not model(**alike).shows_faults_of(DRAG)


def test_an_effect_is_taken_out_with_its_parameters_and_no_other():
    both = model(FLUX, DRAG, magnet_flux__change=-0.05, viscous_drag__coefficient=1e-5, k1=0.02)
    effects, frees, point = strip(both, FLUX)
    assert effects == (DRAG,)
    assert point == {"viscous_drag.coefficient": 1e-5, "k1": 0.02}
    assert [f.name for f in frees] == [*(f.name for f in K_FREE), "viscous_drag.coefficient"]


def test_faults_that_an_effect_stood_for_are_free_again_without_it():
    """Of a set without the magnet, fitted without one of the shorts that it did for, nothing could come near."""
    without = [f for f in (*K_FREE, *DRAG.frees) if f.name != "k5"]
    assert free_again(tuple(without), FLUX) == (*K_FREE, *DRAG.frees)
    assert free_again(tuple(without), DRAG) == tuple(without)


def test_an_effect_at_the_end_of_what_is_credible_is_no_cause_but_at_nothing_it_is():
    (f,) = DRAG.frees
    assert is_credible(model(DRAG, viscous_drag__coefficient=0.5 * f.high))
    assert not is_credible(model(DRAG, viscous_drag__coefficient=f.high))
    late = candidate("comparator_delay.time")
    assert is_credible(model(late, comparator_delay__time=0.0))  # neutral, though it is a bound
    assert not is_credible(model(late, comparator_delay__time=late.frees[0].high))


def test_a_model_of_three_effects_is_full_and_a_second_line_is_no_further_cause():
    third, line = candidate("inertia.change"), candidate("torque_line.amplitude")
    assert not model(FLUX, DRAG, line).is_full
    assert model(FLUX, DRAG, third).is_full


def test_enough_is_a_share_of_what_there_was_and_never_far_from_the_data():
    assert is_enough(model(FLUX, heldout=1.2), model(heldout=50.0))
    assert not is_enough(model(FLUX, heldout=20.0), model(heldout=1e6))
    assert not is_enough(model(heldout=1.0), model(heldout=1.0))  # without an effect nothing is explained


def test_models_that_leave_as_much_are_alike():
    best = model(FLUX, heldout=1.01)
    assert is_alike(model(DRAG, heldout=1.02), best)
    assert not is_alike(model(DRAG, heldout=3.0), best)


@pytest.mark.parametrize(("time", "is_one"), [(2e-6, False), (4e-6, True), (3e-4, True)])
def test_a_delay_by_which_simulations_of_one_law_differ_is_none(time, is_one):
    """Two simulators that sample and decide in another order within a step were told apart by 2 µs, at nine sigma."""
    late = candidate("controller_delay.time")
    assert is_credible(model(late, controller_delay__time=time)) == is_one
    assert is_something(model(late, controller_delay__time=time), late) == is_one
