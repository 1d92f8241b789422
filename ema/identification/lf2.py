"""Iterative identification with LF2, warm-started from the linear answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import linear
from .gauss_newton import GaussNewton

if TYPE_CHECKING:
    from ema.bundle import Bundle


def make(bundle: Bundle) -> GaussNewton:
    """The LF2 identifier of a bundle; what is known of the library's error is taken off."""
    first, noise = linear.make(bundle), bundle.noise("lf2")
    library, error = bundle.lf2().at(bundle.schedule), bundle.known_error("lf2")

    def model(k: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return library(k) + error(k) + noise.start_shift(start)

    return GaussNewton("lf2", model, noise, lambda measurement: first.estimate(measurement).k)
