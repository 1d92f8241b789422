"""Intervals of the balance: of what scatters, and of what it cannot tell from a law."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.axis.balance.found import draw


def fit(inertia):
    return SimpleNamespace(base=("inertia",), laws=(), coefficients=np.array([inertia]))


def test_the_rest_is_as_often_what_it_is_beside_a_rival_as_the_rival_wins():
    term = SimpleNamespace(instead=(fit(3.0), fit(5.0)), alike={"one": 0.3, "other": 0.2})
    corrected = SimpleNamespace(coefficients=np.array([1.0]), covariance=np.array([[1e-6]]))
    drawn = draw(SimpleNamespace(model=fit(1.0), corrected=corrected, terms=(term,)))[:, 0]
    shares = [np.mean(np.abs(drawn - inertia) < 0.1) for inertia in (1.0, 3.0, 5.0)]
    assert shares == pytest.approx([0.5, 0.3, 0.2], abs=0.08)
