"""An axis that creeps between its moves: rows in which friction is not that of sliding are no evidence of gravity."""

from __future__ import annotations

import numpy as np
import on_paper
import pytest

from ema.discrepancy.axis.balance.regressing.creeping import chosen, slides

GRAVITY, CREEP = 0.006, 0.1  # [N m]; [rad/s]


class Moves:
    """Four moves forth and back, each followed by a creep the same way."""

    def at(self, t):
        phase = (t / 0.75) % 1.0
        way = np.where((t // 0.75) % 2.0 == 0.0, 1.0, -1.0)
        w = way * (CREEP + np.where(phase < 0.7, 8.0 * np.sin(np.pi * phase / 0.7) ** 2, 0.0))
        theta = np.concatenate(([0.0], np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(t)))) - 0.9
        return theta, w, np.gradient(w, t)


def balance_of(opposing):
    """The balance of an axis that also has `opposing` to move against."""
    return on_paper.plant(on_paper.cycle(opposing, swing=Moves())).balance


def gravity_of(balance):
    (term,) = [term for term in balance.terms if term.law.name == "pendulum"]
    return term.law.values(balance.corrected.coefficients[balance.model.part(term.law)])["amplitude"]


def sticks(t, theta, w):
    """While it creeps, friction holds as much of the weight as it likes."""
    creeps = np.abs(w) <= 1.5 * CREEP
    return GRAVITY * np.sin(theta) * np.where(creeps, 2.0 + np.sin(9.0 * t), 1.0)


def falls_with_speed(t, theta, w):
    return GRAVITY * np.sin(theta) + 0.004 * np.sign(w) * np.exp(-((w / 0.5) ** 2))


def test_rows_that_creep_are_left_out_where_the_others_are_foretold_better():
    balance = balance_of(sticks)
    assert 0.2 < balance.creeps < 0.6
    assert gravity_of(balance) == pytest.approx(GRAVITY, rel=0.03)


def test_friction_that_falls_with_speed_stays_in():
    balance = balance_of(falls_with_speed)
    assert balance.creeps == 0.0
    assert {"pendulum", "stribeck"} <= {term.law.name for term in balance.terms}
    assert gravity_of(balance) == pytest.approx(GRAVITY, rel=0.03)


def test_an_axis_that_slides_all_the_time_keeps_every_row():
    assert balance_of(lambda t, theta, w: GRAVITY * np.sin(theta)).creeps == 0.0


def test_some_of_the_rows_are_the_same_rows():
    rows = balance_of(falls_with_speed).model.rows
    quick = slides(rows)
    few = chosen(rows, quick)
    assert 0 < len(few.y) < len(rows.y)
    assert few.integrate @ few.motion.w == pytest.approx((rows.integrate @ rows.motion.w)[quick])
    assert few.n_blocks == len(np.unique(rows.block[quick]))
