"""Friction that falls with speed, and a stretch of the travel with more of it: where searches begin."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.reading.sizes import sizes
from ema.discrepancy.axis.scanning.fading import SPEEDS, fading_candidate, fadings
from ema.discrepancy.axis.scanning.stretch import WIDTHS, stretch_candidate
from ema.discrepancy.axis.scanning.weak_form import weak_form
from ema.effects.position_friction import FORMS

AT = {"F_d": on_paper.F_D}
EXCESS, SPEED = 0.6, 0.8
HEIGHT, CENTRE, WIDTH = 0.8, -0.9, 0.3


def falling(t, theta, w):
    return on_paper.F_D * EXCESS * np.sign(w) * np.exp(-np.abs(w) / SPEED)


def tight(t, theta, w):
    return on_paper.F_D * HEIGHT * np.sign(w) * np.exp(-(((theta - CENTRE) / WIDTH) ** 2))


@pytest.fixture(scope="module")
def quiet():
    return on_paper.plant(on_paper.cycle())


@pytest.fixture(scope="module")
def with_falling():
    return on_paper.plant(on_paper.cycle(falling))


@pytest.fixture(scope="module")
def with_tight():
    return on_paper.plant(on_paper.cycle(tight))


def fading(plant, point=AT):
    return fading_candidate(plant, sizes(plant), point, on_paper.everywhere(plant))


def stretch(plant, point=AT):
    return stretch_candidate(plant, sizes(plant), point, on_paper.everywhere(plant))


def test_friction_that_falls_is_looked_for_from_about_its_speed_and_size(with_falling):
    found = fading(with_falling, {"F_d": 0.7 * on_paper.F_D})
    speed, excess, F_d = (found.starts[0][name] for name in ("stribeck.speed", "stribeck.excess", "F_d"))
    step = SPEEDS[1] / SPEEDS[0]
    assert SPEED / step < speed < SPEED * step
    assert excess == pytest.approx(EXCESS, rel=0.3)
    assert F_d == pytest.approx(on_paper.F_D, rel=0.1)
    assert len(found.starts) > 1
    assert all(f.low <= start[f.name] <= f.high for f in found.free for start in found.starts)


def test_the_likeliest_speed_leaves_least_and_the_friction_is_the_larger_one_at_rest(with_falling):
    weak = weak_form(with_falling, AT, on_paper.everywhere(with_falling))
    every = fadings(weak, weak.always(), SPEEDS * 5.0)
    assert [f.left for f in every] == sorted(f.left for f in every)
    assert all(f.torque > 0.0 for f in every)
    assert every[0].left < 0.5 * every[-1].left


def test_friction_that_rises_with_speed_does_not_fall():
    plant = on_paper.plant(on_paper.cycle(lambda t, theta, w: -0.3 * falling(t, theta, w)))
    weak = weak_form(plant, AT, on_paper.everywhere(plant))
    assert fadings(weak, weak.always(), SPEEDS * 5.0) == []
    (start,) = fading(plant).starts  # where nothing is known
    assert start.keys() == {f.name for f in fading(plant).free}


def test_friction_that_does_not_fall_is_explained_no_better(quiet, with_falling):
    weak, other = (weak_form(p, AT, on_paper.everywhere(p)) for p in (quiet, with_falling))
    before = [float(w.beside()[1] @ w.beside()[1]) for w in (weak, other)]
    after = [fadings(w, w.always(), SPEEDS * 5.0) for w in (weak, other)]
    assert not after[0] or after[0][0].left > 0.9 * before[0]
    assert after[1][0].left < 0.1 * before[1]


def test_a_tight_stretch_is_looked_for_where_it_is(with_tight):
    found = stretch(with_tight)
    start = found.starts[0]
    assert start["position_friction.centre"] == pytest.approx(CENTRE, abs=0.3 * WIDTH)
    assert start["position_friction.height"] == pytest.approx(HEIGHT, rel=0.3)
    assert WIDTH / 2.0 < start["position_friction.width"] < WIDTH * 2.0
    assert len(found.starts) == len(WIDTHS) * len(FORMS)


def test_a_travel_that_is_tight_nowhere_shows_no_height(quiet):
    assert abs(stretch(quiet).starts[0]["position_friction.height"]) < 0.1


def test_what_the_model_has_is_not_looked_for_again(with_falling, with_tight):
    assert fading(with_falling, AT | {"stribeck.excess": 0.1}) is None
    assert stretch(with_tight, AT | {"position_friction.height": 0.1}) is None
