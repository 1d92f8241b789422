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
    search = SimpleNamespace(plant=plant, noise="noise", train=[0, 1], heldout=[2], tried=list(tried), asked=[])
    search.fitted_to_all = lambda m: search.asked.append(m) or fitted("noise", *m.names, cycles=(0, 1, 2))
    return search


def test_each_set_is_fitted_once_by_one_noise():
    load, spring, far = (fitted("noise", "constant_load"), fitted("noise", "spring_load"),
                         fitted("noise", "cogging", misfit=50.0))  # fmt: skip
    known = fitted("noise", "spring_load", cycles=(0, 1, 2))
    search = searching(load, spring, far, known)
    found = _fit_to_all(search, load)
    assert search.asked == [load]
    assert found[1] is known
    by_other = searching(load, spring, fitted("noise of before", "spring_load", cycles=(0, 1, 2)))
    _fit_to_all(by_other, load)
    assert by_other.asked == [load, spring]


def test_a_set_is_fitted_again_from_where_less_is_left():
    first, better = fitted("noise", "spring_load"), fitted("noise", "spring_load", misfit=0.9)
    search = searching(first, fitted("noise", "spring_load", cycles=(0, 1, 2)), better)
    _fit_to_all(search, first)
    assert search.asked == [better]


def test_none_is_where_held_out_cycles_repeat_the_motions_of_training():
    assert _fit_to_all(searching(fitted("noise", "spring_load"), motion=(0, 0, 0)), fitted("noise")) == []
