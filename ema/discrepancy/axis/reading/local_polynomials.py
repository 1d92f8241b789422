"""Channels smoothed by local polynomials (Savitzky and Golay), each part between gaps by itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from ema.core.records import Array


def smooth(x: Array, gaps: NDArray[np.int_], width: int, dt: float | None = None, degree: int = 2) -> Array:
    """Local polynomials over `width` samples, or with `dt` their slope; a part of fewer samples as it is, or level."""
    parts = np.split(x, gaps)
    if dt is None:
        return np.concatenate([savgol_filter(p, width, degree) if len(p) >= width else p for p in parts])
    slope = (savgol_filter(p, width, degree, deriv=1, delta=dt) if len(p) >= width else np.zeros(len(p)) for p in parts)
    return np.concatenate(list(slope))


def left_of_noise(width: int, degree: int = 2) -> float:
    """Share of white noise's variance that a local polynomial leaves in its middle sample.

    It is also what the sample and the smoothed one have in common: their difference has the rest.
    """
    return float(savgol_coeffs(width, degree)[width // 2])


def slope_of_noise(width: int, dt: float, degree: int = 2) -> float:
    """Noise of a smoothed slope, per noise of one sample."""
    return float(np.linalg.norm(savgol_coeffs(width, degree, deriv=1, delta=dt)))
