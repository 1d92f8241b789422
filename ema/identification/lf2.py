"""Iterative identification with LF2, warm-started from the linear answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import linear
from .gauss_newton import GaussNewton
from .nuisance import N_FAULTS

if TYPE_CHECKING:
    from ema.bundle import Bundle


def make(bundle: Bundle) -> GaussNewton:
    """The LF2 identifier of a bundle; what is known of the library's error is taken off."""
    first, noise = linear.make(bundle), bundle.noise("lf2")
    library, error = bundle.lf2().at(bundle.schedule), bundle.known_error("lf2")

    def model(x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return library(x[..., :N_FAULTS]) + error(x) + noise.start_shift(start, x[..., :N_FAULTS])

    nuisance = bundle.nuisance
    return GaussNewton("lf2", model, noise, nuisance.started_by(first), nuisance=nuisance)
