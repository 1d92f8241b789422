"""Estimates before the bounds 0 ≤ k ≤ 1: faults that cannot be speak against the model, however small the residual.

An actuator livelier than its bundle (magnets stronger by 0.5 %) reads as shorts of less than none. The bounds forbid
them, and what they would explain is put on other faults, within a residual that the noise explains. The distance of the
estimate from the bounds tells: squared, in the metric of its covariance, it is χ² of as many degrees of freedom as
there are bounds that it lies beyond [1]_. Of several cycles the mean is looked at: what is drawn anew in each of them
is averaged out, the model's own error is the same in all.

References
----------
.. [1] Silvapulle, Sen, "Constrained Statistical Inference", Wiley 2005, section 3.4.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from .weighted import Whitener, bounded_least_squares, p_value

AT_BOUND = 1e-9


class Unbounded(NamedTuple):
    """Estimate `k` (6,) before the bounds and its covariance (6, 6): drawn in this cycle alone, and shared by all."""

    k: np.ndarray
    own: np.ndarray
    shared: np.ndarray


def p_possible(estimates: Collection[Unbounded]) -> float:
    """Probability that the mean lies farther beyond the bounds if the model holds; one where it lies within."""
    k, own, shared = (np.mean(part, axis=0) for part in zip(*estimates, strict=True))
    if k.min() >= 0.0 and k.max() <= 1.0:
        return 1.0
    white = Whitener(shared + own / len(estimates))
    inside = bounded_least_squares(white(np.eye(len(k))), white(k), np.zeros(len(k)), np.ones(len(k))).x
    w = white(k - inside)
    beyond = (inside <= AT_BOUND) | (inside >= 1.0 - AT_BOUND)
    return p_value(float(w @ w), int(beyond.sum()))
