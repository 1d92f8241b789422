"""Sets fitted to motions of training and held-out cycles alike: each once, and only those that may lead."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ema.discrepancy.actuator.scoring.entrants import _fit_to_all


def fitted(by, *names, misfit=1.0, cycles=(0, 1)):
    fit = SimpleNamespace(misfit=misfit, residuals=dict.fromkeys(cycles))
    return SimpleNamespace(names=names, fit=fit, by=by, excess=0.0, heldout=1.0)


def searching(*tried, motion=(0, 0, 1)):
    """A search whose third cycle is held out and has a motion of its own, unless told."""
    plant = SimpleNamespace(data=SimpleNamespace(motion=np.array(motion), n_cycles=3))
    search = SimpleNamespace(plant=plant, noise="noise", train=[0, 1], heldout=[2], tried=list(tried), asked={})

    def fitted_to_all(m, to_beat):
        search.asked[m.names] = m, to_beat
        return fitted("noise", *m.names, cycles=(0, 1, 2))

    search.fitted_to_all = fitted_to_all
    return search


def test_each_set_is_fitted_once_the_answer_first():
    load, spring, drag = (fitted("noise", name) for name in ("constant_load", "spring_load", "viscous_drag"))
    far = fitted("noise", "cogging", misfit=50.0)
    known = fitted("noise of before", "spring_load", cycles=(0, 1, 2))
    search = searching(spring, drag, far, load, known)
    found = _fit_to_all(search, load)
    assert list(search.asked) == [("constant_load",), ("viscous_drag",)]
    assert known in found
    assert search.asked["constant_load",][1] == np.inf  # the others are given up where they cannot come near it
    assert search.asked["viscous_drag",][1] < 2.0


def test_a_set_is_fitted_again_from_where_less_is_left():
    load, first, better = (fitted("noise", "constant_load"), fitted("noise", "spring_load"),
                           fitted("noise", "spring_load", misfit=0.9))  # fmt: skip
    search = searching(load, first, fitted("noise", "spring_load", cycles=(0, 1, 2)), better)
    _fit_to_all(search, load)
    assert search.asked["spring_load",][0] is better


def test_none_is_where_held_out_cycles_repeat_the_motions_of_training():
    assert _fit_to_all(searching(fitted("noise", "spring_load"), motion=(0, 0, 0)), fitted("noise")) == []
