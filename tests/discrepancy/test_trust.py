"""What folds find with other parameters is judged by each fold's own."""

from __future__ import annotations

import numpy as np

from ema.discrepancy.fitting import Fit
from ema.discrepancy.plant import Candidate, Free
from ema.discrepancy.selection import Tried
from ema.discrepancy.trust import leans_in_a_fold


def line(order, value):
    """A line of torque, and a fit of it."""
    free = Free(f"cogging:{order}.cos", "N m", -1.0, 1.0, 0.1, 0.1)
    candidate = Candidate("cogging", "cogging", (free,), ({free.name: 0.1},))
    return candidate, Fit((free,), {free.name: value}, [], np.eye(1), (0,), 1.0)


def tried(*lines):
    candidates, fits = zip(*lines, strict=True)
    return Tried(candidates[:1], fits, tuple((c,) for c in candidates), ())


def test_a_line_that_another_fold_has_at_another_order_is_looked_up_there():
    assert not leans_in_a_fold(tried(line(16, 0.2), line(12, 0.3)), 0)


def test_a_law_that_ends_at_its_bound_in_one_fold_leans():
    assert leans_in_a_fold(tried(line(16, 0.2), line(12, 1.0)), 0)
