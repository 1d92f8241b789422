"""The monitored signal: the envelope of the phase currents, one function for builder, daemon and replay alike."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.signal import butter, filtfilt

CUTOFF = 200.0  # [Hz]
ORDER = 2


@cache
def _filter(rate: float) -> tuple[np.ndarray, np.ndarray]:
    b, a = butter(ORDER, CUTOFF, fs=rate)
    return b, a


def envelope(i_abc: np.ndarray, rate: float) -> np.ndarray:
    """DC-equivalent current: half the sum of the absolute phase currents, low-passed without phase shift.

    Parameters
    ----------
    i_abc : array, shape (..., 3, n_times)
        Measured phase currents of whole cycles. [A]
    rate : float
        Sampling rate. [Hz]

    Returns
    -------
    i : array, shape (..., n_times)
        Envelope. [A]
    """
    return smoothed(rectified(i_abc), rate)


def rectified(i_abc: np.ndarray) -> np.ndarray:
    """DC-equivalent current before the low-pass.   ½ Σ |i_j|   (..., 3, n_times) → (..., n_times) [A]"""
    half_sum: np.ndarray = 0.5 * np.abs(i_abc).sum(axis=-2)
    return half_sum


def smoothed(x: np.ndarray, rate: float) -> np.ndarray:
    """The envelope's low-pass over the last axis, without phase shift, shape of `x`."""
    b, a = _filter(rate)
    return np.asarray(filtfilt(b, a, x, axis=-1))
