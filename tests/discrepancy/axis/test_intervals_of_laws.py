"""Intervals of the balance: of what scatters, and of what it cannot tell from a law."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.axis.balance.laws.law import Law, one
from ema.discrepancy.axis.balance.regressing.found import draw, draw_law


def fit(inertia):
    return SimpleNamespace(base=("inertia",), laws=(), coefficients=np.array([inertia]))


def test_the_rest_is_as_often_what_it_is_beside_a_rival_as_the_rival_wins():
    term = SimpleNamespace(instead=(fit(3.0), fit(5.0)), alike={"one": 0.3, "other": 0.2}, members=())
    corrected = SimpleNamespace(coefficients=np.array([1.0]), covariance=np.array([[1e-6]]))
    drawn = draw(SimpleNamespace(model=fit(1.0), corrected=corrected, terms=(term,)))[:, 0]
    shares = [np.mean(np.abs(drawn - inertia) < 0.1) for inertia in (1.0, 3.0, 5.0)]
    assert shares == pytest.approx([0.5, 0.3, 0.2], abs=0.08)


def test_the_way_of_friction_is_as_wide_as_members_of_its_family_that_leave_as_little():
    def over(way):
        return Law("memory", f"over {way}", "memory", lambda m, _: (), {}, one("torque", way=way), "", "")

    def model(way, torque):
        return SimpleNamespace(
            base=(), laws=(over(way),), coefficients=np.array([torque]), part=lambda law: slice(0, 1)
        )

    corrected = SimpleNamespace(coefficients=np.array([1.0]), covariance=np.array([[1e-6]]))
    term = SimpleNamespace(law=over(0.1), instead=(), alike={}, members=((model(0.2, 3.0), 0.3),))
    drawn = draw_law(SimpleNamespace(model=model(0.1, 1.0), corrected=corrected, terms=(term,)), term)
    values = [law.values(c) for law, c in drawn]
    wider = [v["torque"] for v in values if v["way"] == 0.2]
    assert len(wider) / len(values) == pytest.approx(0.3, abs=0.08)
    assert wider == pytest.approx([3.0] * len(wider), abs=0.01)
    assert [v["torque"] for v in values if v["way"] == 0.1] == pytest.approx(
        [1.0] * (len(values) - len(wider)), abs=0.01
    )
