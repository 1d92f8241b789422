"""How much of another law's form a law may be, on columns that are known on paper."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ema.discrepancy.axis.balance.regressing.form import of_others
from ema.discrepancy.axis.balance.regressing.regression import Regression
from ema.discrepancy.form import FORM

POWER, LEFT, NOISE = 100.0, 3.0, 1.0
BLOCKS = np.repeat(np.arange(4), 50)
SHAPE = np.tile(np.sin(2.0 * np.pi * np.arange(50) / 50.0), 4)


def balance(own, its, left=LEFT):
    """Of two laws, a column each."""
    terms = [SimpleNamespace(law=SimpleNamespace(key=key, freer=None), power=POWER) for key in ("own", "its")]
    part = {"own": slice(0, 1), "its": slice(1, 2)}
    rows = SimpleNamespace(block=BLOCKS, n_blocks=4)
    model = SimpleNamespace(design=np.stack([own, its], axis=1), rows=rows, part=lambda law: part[law.key])
    model.beside_others = lambda part, x: Regression.beside_others(model, part, x)
    return SimpleNamespace(
        model=model, terms=terms, corrected=SimpleNamespace(coefficients=np.ones(2)), left=left, noise=NOISE
    )


@pytest.mark.parametrize("left", [1.0, 3.0])
def test_what_another_law_is_by_its_strength_in_blocks_may_be_its_form(left):
    b = balance(SHAPE * np.array([1.0, -1.0, 1.0, -1.0])[BLOCKS], SHAPE, left)
    assert of_others(b, b.terms[0]) == pytest.approx(FORM**2 * POWER if left > NOISE else 0.0, abs=1e-6)


def test_what_looks_like_nothing_that_another_law_does_is_not_its_form():
    b = balance(SHAPE, np.tile(np.cos(2.0 * np.pi * np.arange(50) / 50.0), 4))
    assert of_others(b, b.terms[0]) == pytest.approx(0.0, abs=1e-9)


def test_a_form_that_would_leave_more_than_is_left_is_none():
    """Half of it looks like the law: the other half would be left, and little is."""
    half = np.tile(np.cos(2.0 * np.pi * np.arange(50) / 50.0), 4)
    b = balance((SHAPE + half) * np.array([1.0, -1.0, 1.0, -1.0])[BLOCKS], SHAPE, left=1.5)
    assert of_others(b, b.terms[0]) == pytest.approx(0.5 * 0.5 / 0.5)
