"""The recorded drive with less of its noise, as far as the record shows that nothing but noise is taken from it.

A simulation is driven by what was recorded, noise and all, and what the noise does in it depends on the model: a gear
that gives rings with it, a drive that lags takes some away. Laws were weighed by that. What is left after smoothing is
slow, and does the same in all of them.

A local quadratic keeps the drive's integral and its next moments: where a jump is spread over some samples, angle and
speed behind it are what they were.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ema.core.records import Array

from .local_quadratics import left_of_noise, smooth, smooth_twice
from .noise import ESTIMATE_UNCERTAINTY, Noise, disagreement

WIDTHS = (5, 7, 11, 21, 41, 81, 161)  # samples; what is slower than the widest shakes all models alike
AGREE = 2.5  # deviations within which all that are no wider tell a sample
USUAL = 0.68  # of samples: what disagrees more with its neighbours tells nothing of a cycle's noise
BESIDE = 0.1  # of the noise's variance: what else a width may take away where widths agree


def quieten(t: Array, drive: Array, gaps: NDArray[np.int_], noise: Noise) -> tuple[Array, Array]:
    """The smoothed drive, and the share of the noise's variance that is left in it; both of shape (n_times,).

    Each sample is smoothed as widely as the intervals that the narrower widths give for it have a value in common
    (Goldenshluger and Nemirovski; Katkovnik): where the drive jumps, it stays as recorded. So little may be off by the
    same share in every wave of a record: it is smoothed twice, which squares that share.
    """
    quiet, left = drive, np.ones(len(drive))
    if noise.is_bound:  # it has no noise of its own
        return quiet, left
    sigma = noise.rms(np.gradient(smooth(drive, gaps, WIDTHS[0]), t)) * _of_cycle(t, drive, noise)
    low, high = drive - AGREE * sigma, drive + AGREE * sigma
    agreed = np.ones(len(drive), bool)
    for width in WIDTHS:
        wide, share = smooth(drive, gaps, width), left_of_noise(width)
        low = np.maximum(low, wide - AGREE * np.sqrt(share) * sigma)
        high = np.minimum(high, wide + AGREE * np.sqrt(share) * sigma)
        agreed &= (low <= high) & _is_inside(len(drive), gaps, width)
        taken = ((drive - wide) / sigma)[agreed] ** 2
        if not agreed.any() or np.mean(taken) > (1.0 - share) * (1.0 + ESTIMATE_UNCERTAINTY) ** 2 + BESIDE:
            break
        twice, of_twice = smooth_twice(drive, wide, gaps, width)
        quiet, left = np.where(agreed, twice, quiet), np.where(agreed, of_twice, left)
    return quiet, left


def _of_cycle(t: Array, drive: Array, noise: Noise) -> float:
    """Noise of this cycle over that of all."""
    r, slope, _ = disagreement(t, drive)
    return float(np.quantile(np.abs(r) / noise.rms(slope), USUAL) / norm.ppf(0.5 + 0.5 * USUAL))


def _is_inside(n: int, gaps: NDArray[np.int_], width: int) -> NDArray[np.bool_]:
    """Samples with as many on both sides: at an end a quadratic leaves most of a sample's noise."""
    inside = np.zeros(n, bool)
    for part in np.split(np.arange(n), gaps):
        inside[part[width - 1 : len(part) - width + 1]] = True
    return inside
