"""The recorded drive with less of its noise, as far as the record shows that nothing but noise is taken from it.

A simulation is driven by what was recorded, noise and all, and what the noise does in it depends on the model: a gear
that gives rings with it, a drive that lags takes some away. Laws were weighed by that. What is left after smoothing is
slow, and does the same in all of them.

A local polynomial keeps the drive's integral and its next moments: where a bend is spread over some samples, angle and
speed behind it are what they were. Of degree four it takes little from a wave of its own width.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs
from scipy.stats import norm

from ema.core.records import Array

from .local_polynomials import left_of_noise, smooth
from .noise import ESTIMATE_UNCERTAINTY, Noise, disagreement

DEGREE = 4
WIDTHS = (7, 11, 15, 21, 31, 41, 61)  # samples; wider ones take from waves that a record shows
AGREE = 1.5  # deviations within which all that are no wider tell a sample
BIASED = 4.0  # deviations of noise by which what is taken may change a wave of the record
CLEAR = 3.0  # deviations by which noise alone may have more
USUAL = 0.68  # of samples: what disagrees more with its neighbours tells nothing of a cycle's noise


def quieten(t: Array, drive: Array, gaps: NDArray[np.int_], noise: Noise) -> tuple[Array, Array]:
    """The smoothed drive, and the share of the noise's variance that is left in it; both of shape (n_times,).

    Each sample is smoothed as widely as the intervals that it and the narrower widths give have a value in common
    (Goldenshluger and Nemirovski; Katkovnik): where the drive jumps, it stays as recorded. Samples that are smoothed
    unalike do not add up to what they were; what is slow in the rest, as momentum is, is given back.
    """
    quiet, left = drive, np.ones(len(drive))
    if noise.is_bound:  # it has no noise of its own
        return quiet, left
    sigma = noise.rms(np.gradient(smooth(drive, gaps, WIDTHS[0], degree=DEGREE), t)) * _of_cycle(t, drive, noise)
    low, high = drive - AGREE * sigma, drive + AGREE * sigma
    agreed = np.ones(len(drive), bool)
    for width in WIDTHS:
        wide, share = smooth(drive, gaps, width, degree=DEGREE), left_of_noise(width, DEGREE)
        low = np.maximum(low, wide - AGREE * np.sqrt(share) * sigma)
        high = np.minimum(high, wide + AGREE * np.sqrt(share) * sigma)
        agreed &= (low <= high) & _is_inside(len(drive), gaps, width)
        if not agreed.any() or _takes_a_wave(np.where(agreed, (drive - wide) / sigma, 0.0), width):
            break
        quiet, left = np.where(agreed, wide, quiet), np.where(agreed, share, left)
    return _give_back(drive, quiet, left, gaps), left


def quieten_alike(x: Array, left: Array) -> Array:
    """What becomes of `x`, recorded without a gap, where a drive was smoothed so that `left` is left of its noise."""
    quiet, gaps = x, np.empty(0, int)
    for width in WIDTHS:
        here = np.isclose(left, left_of_noise(width, DEGREE))
        quiet = np.where(here, smooth(x, gaps, width, degree=DEGREE), quiet) if here.any() else quiet
    return _give_back(x, quiet, left, gaps)


def _give_back(drive: Array, quiet: Array, left: Array, gaps: NDArray[np.int_]) -> Array:
    slow = smooth(drive - quiet, gaps, WIDTHS[-1], degree=DEGREE)
    return np.where(left < 1.0, quiet + slow, drive)


def _takes_a_wave(taken: Array, width: int) -> bool:
    """Whether what is taken from the samples, in deviations of their noise, has in any octave what noise has not.

    A wave that is seen in no sample alone stands out over a record, the ripple of a current that holds against cogging
    at a speed that varies too. Of noise a width takes (1 - K)² of each wave's power, K its gain.
    """
    n = len(taken)
    power = np.abs(np.fft.rfft(taken)) ** 2 / n
    kernel = np.zeros(n)
    kernel[np.arange(width) - width // 2] = savgol_coeffs(width, DEGREE)
    of_noise = (1.0 - np.fft.rfft(kernel).real) ** 2
    octaves = 2 ** np.arange(int(np.log2(len(power))) + 1) - 1
    more = np.add.reduceat(power - (1.0 + ESTIMATE_UNCERTAINTY) ** 2 * of_noise, octaves)
    by_chance = CLEAR * np.sqrt(np.add.reduceat(of_noise**2, octaves))
    return bool((more > BIASED**2 + by_chance).any())


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
