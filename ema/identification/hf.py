"""Iterative identification with the HF model itself, warm-started from LF2. Needs a JIT: never in the daemon's process.

Base point and all columns of a step are the 16 lanes of one batch. Switching decorrelates two runs at any distance, so
differences are taken over a step far above its noise, and what the model's own noise leaves is part of the covariance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ema.models import hf

from . import lf2
from .gauss_newton import GaussNewton, Options
from .nuisance import N_FAULTS

if TYPE_CHECKING:
    from ema.bundle import Bundle

OPTIONS = Options(dk=0.08, central=True, n_base=4, n_steps=5, tolerance=0.1)  # 4 + 2·6 = 16 lanes; two batches with ν
SEED = 0x48460000  # of the model's noise; any but the measured actuator's own


def make(bundle: Bundle, options: Options = OPTIONS) -> GaussNewton:
    """The HF identifier of a bundle."""
    plant, schedule, noise, nuisance = bundle.plant, bundle.schedule, bundle.noise("hf"), bundle.nuisance
    first = lf2.make(bundle)

    def model(x: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        theta_u, theta_g = np.hsplit(np.zeros(2) if start is None else start, 2)
        state = hf.start_at(plant, theta_u, theta_g * plant.transmission.GR)
        seeds = SEED + np.arange(len(x)) + int(1e6 * np.abs(x).sum())
        runs = hf.simulate(plant, x[:, :N_FAULTS], seeds=seeds, start=state, effects=nuisance.effects(x, plant.effects))
        return runs.envelope[:, schedule]

    return GaussNewton("hf", model, noise, nuisance.started_by(first), options, nuisance)
