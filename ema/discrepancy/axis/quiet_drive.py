"""The recorded drive with less of its noise, as far as the record shows that nothing but noise is taken from it.

A simulation is driven by what was recorded, noise and all, and what the noise does in it depends on the model: a gear
that gives rings with it, a drive that lags takes some away. Laws were weighed by that. What is left after smoothing is
slow, and does the same in all of them.

A local quadratic keeps the drive's integral and its next moments: where a bend is spread over some samples, angle and
speed behind it are what they were.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ema.core.records import Array

from .local_quadratics import left_of_noise, smooth
from .noise import ESTIMATE_UNCERTAINTY, Noise, disagreement

WIDTHS = (5, 7, 11, 15, 21, 31, 41, 61)  # samples; the bias of each is a fourth of the next one's
AGREE = 1.5  # deviations within which all that are no wider tell a sample
BESIDE = 0.1  # of the noise's variance: what else a width may take away where widths agree
USUAL = 0.68  # of samples: what disagrees more with its neighbours tells nothing of a cycle's noise


def quieten(t: Array, drive: Array, gaps: NDArray[np.int_], noise: Noise) -> tuple[Array, Array]:
    """The smoothed drive, and the share of the noise's variance that is left in it; both of shape (n_times,).

    At each sample the widths are asked for up to which the intervals that all give have a value in common
    (Goldenshluger and Nemirovski; Katkovnik); the last but one of these is taken. So bias stays a small part of what
    noise is left, and where the drive jumps, it stays as recorded.
    """
    quiet, left = drive, np.ones(len(drive))
    if noise.is_bound:  # it has no noise of its own
        return quiet, left
    sigma = noise.rms(np.gradient(smooth(drive, gaps, WIDTHS[0]), t)) * _of_cycle(t, drive, noise)
    low, high = drive - AGREE * sigma, drive + AGREE * sigma
    agreed = np.ones(len(drive), bool)
    narrower, of_narrower = drive, 1.0
    for width in WIDTHS:
        wide, share = smooth(drive, gaps, width), left_of_noise(width)
        low = np.maximum(low, wide - AGREE * np.sqrt(share) * sigma)
        high = np.minimum(high, wide + AGREE * np.sqrt(share) * sigma)
        agreed &= (low <= high) & _is_inside(len(drive), gaps, width)
        taken = ((drive - wide) / sigma)[agreed] ** 2
        if not agreed.any() or np.mean(taken) > (1.0 - share) * (1.0 + ESTIMATE_UNCERTAINTY) ** 2 + BESIDE:
            break
        quiet, left = np.where(agreed, narrower, quiet), np.where(agreed, of_narrower, left)
        narrower, of_narrower = wide, share
    return quiet, left


def _of_cycle(t: Array, drive: Array, noise: Noise) -> float:
    """Noise of this cycle over that of all."""
    r, slope, _ = disagreement(t, drive)
    return float(np.quantile(np.abs(r) / noise.rms(slope), USUAL) / norm.ppf(0.5 + 0.5 * USUAL))


def _is_inside(n: int, gaps: NDArray[np.int_], width: int) -> NDArray[np.bool_]:
    """Samples with as many on both sides: at an end a quadratic leaves most of a sample's noise."""
    inside = np.zeros(n, bool)
    for part in np.split(np.arange(n), gaps):
        inside[part[width // 2 : len(part) - width // 2]] = True
    return inside
