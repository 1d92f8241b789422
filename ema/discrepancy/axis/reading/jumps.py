"""What a drive does between its samples that a straight line from one to the next does not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ema.core.records import Array

from .noise import Noise

SHOWN = 5.0  # deviations of what noise makes of a third difference, or of what they usually are
OF_NOISE = np.sqrt(1.0 + 9.0 + 9.0 + 1.0)  # of a third difference, one deviation of the samples' noise
OF_JUMP = 2.0  # third difference over a jump by one
USUAL = norm.ppf(0.75)  # deviations of the median of absolute normal numbers
AT_ANY_MOMENT = 1.0 / np.sqrt(12.0)  # deviation of a moment that is somewhere between two samples, over the period


def measure_jumps(t: Array, drive: Array, gaps: NDArray[np.int_], noise: Noise) -> Array:
    """Deviation of the drive's mean over each step from that of a straight line, shape (n_times,); 0 after a part.

    A jump is at some moment between two samples, which a record does not tell. It stands out by its third difference
    from noise and from what the drive does elsewhere. What a controller commands is told by its samples alone.
    """
    out = np.zeros(len(drive))
    if noise.is_bound:
        return out
    sigma = OF_NOISE * noise.rms(np.gradient(drive, t))
    for rows in np.split(np.arange(len(drive)), gaps):
        if len(rows) > 3:
            third = np.abs(np.diff(drive[rows], 3))
            of_noise = np.maximum(sigma[rows[1:-2]], sigma[rows[2:-1]])
            of_noise = np.maximum(of_noise, np.median(third) / USUAL)
            more = np.sqrt(np.maximum(third**2 - of_noise**2, 0.0))
            out[rows[1:-2]] = np.where(third > SHOWN * of_noise, more / OF_JUMP * AT_ANY_MOMENT, 0.0)
    return out
