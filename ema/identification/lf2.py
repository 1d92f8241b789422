"""Iterative identification with LF2, warm-started from the linear answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import linear
from .gauss_newton import GaussNewton

if TYPE_CHECKING:
    from ema.bundle import Bundle


def make(bundle: Bundle) -> GaussNewton:
    """The LF2 identifier of a bundle."""
    first = linear.make(bundle)
    return GaussNewton("lf2", bundle.lf2().at(bundle.schedule), bundle.noise("lf2"), lambda m: first.estimate(m).k)
