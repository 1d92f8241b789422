"""Iterative identification with LF1, warm-started from the linear answer. Needs a JIT: not for the daemon's process."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.models import lf1

from . import linear
from .gauss_newton import GaussNewton, Options

if TYPE_CHECKING:
    from ema.bundle import Bundle

OPTIONS = Options(dk=0.02, n_steps=10, tolerance=0.05)  # friction makes the model kinked: no smaller step


def make(bundle: Bundle) -> GaussNewton:
    """The LF1 identifier of a bundle; what is known of the model's error is taken off."""
    plant, tuning, error = bundle.plant, lf1.Tuning(*bundle.arrays["lf1_tuning"]), bundle.known_error("lf1")
    first = linear.make(bundle)

    def model(k: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        return lf1.simulate(plant, k, tuning, start)[:, bundle.schedule] + error(k)

    return GaussNewton("lf1", model, bundle.noise("lf1"), lambda measurement: first.estimate(measurement).k, OPTIONS)
