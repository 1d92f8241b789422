"""What a recorded bus voltage is good for, by the record itself: its repetitions, its swing and its resolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .resolution import resolution

if TYPE_CHECKING:
    from .measured import Measured

DOUBT = 3.0  # deviations between repetitions that count as none: what drifts is alike in neighbouring averages
LIKE = 0.01  # of what the voltage swings by: what honest simulations of one source may differ by


def resolve(data: Measured, at: Sequence[slice]) -> float | None:
    """Standard deviation with which averages of the bus voltage are to be trusted, None if no repetition tells. [V]

    Parameters
    ----------
    at : sequence of slices
        Where the averages stand among the features of each motion.
    """
    motions = [np.array([data.y[c][at[m]] for c in np.flatnonzero(data.motion == m)]) for m in range(len(at))]
    away = [np.sqrt(len(y) / (len(y) - 1.0)) * (y - y.mean(axis=0)) for y in motions if len(y) > 1]
    scatter = float(np.sqrt(np.mean(np.concatenate([x.ravel() for x in away]) ** 2))) if away else 0.0
    if scatter == 0.0:
        return None
    swing = float(np.sqrt(np.mean(np.concatenate([y.ravel() for y in motions]) ** 2)))
    step = resolution(np.concatenate([s.u_dc.ravel() for s in data.signals if s.u_dc is not None]))
    return float(np.linalg.norm([DOUBT * scatter, LIKE * swing, step / np.sqrt(12.0)]))
