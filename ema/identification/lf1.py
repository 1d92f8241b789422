"""Iterative identification with LF1, warm-started from the linear answer. Needs a JIT: not for the daemon's process."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.models import lf1

from . import linear
from .gauss_newton import GaussNewton, Options
from .nuisance import N_FAULTS

if TYPE_CHECKING:
    from ema.bundle import Bundle

OPTIONS = Options(dk=0.02, n_steps=10, tolerance=0.05)  # friction makes the model kinked: no smaller step


def make(bundle: Bundle) -> GaussNewton:
    """The LF1 identifier of a bundle; what is known of the model's error is taken off."""
    simulate = lf1.anchored(bundle.plant, lf1.Tuning(*bundle.arrays["lf1_tuning"]), bundle.i0)
    first, error = linear.make(bundle), bundle.known_error("lf1")

    def model(x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return simulate(x[:, :N_FAULTS], start)[:, bundle.schedule] + error(x)

    nuisance = bundle.nuisance
    return GaussNewton("lf1", model, bundle.noise("lf1"), nuisance.started_by(first), OPTIONS, nuisance)
