"""Free-run residuals made independent standard normal numbers.

What separates a free run of the right model from the record: noise of each output; the drive's noise, integrated; and
the start state, known only from noisy samples. To first order the deviation δ = (δθ, δω) obeys

    dδθ/dt = δω,    dδω/dt = -d δω + w        y - ŷ = H δ + v

so a Kalman filter with a diffuse start turns y - ŷ into white innovations. Its gains depend on the noise alone, not on
parameters: the transformation is linear and the same for every model that is compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ema.core.records import Array


@dataclass(frozen=True)
class Filter:
    """Gains (n_times, n_channels, 2), innovation rms (n_times, n_channels), rows H (n_channels, 2), steps, damping.

    `begin` is true at the first sample of each window.
    """

    gain: Array
    rms: Array
    H: Array
    dt: Array
    damping: float
    begin: NDArray[np.bool_]

    def whiten(self, residual: Array) -> Array:
        """White innovations of `residual`, shape (n_channels, n_times)."""
        out = np.empty(residual.shape)
        _whiten(residual, self.gain, self.rms, self.H, self.dt, self.damping, self.begin, out)
        return out


def design(H: Array, noise: Array, process: Array, t: Array, start_rms: tuple[float, float], damping: float) -> Filter:
    """Filter for one window.

    Parameters
    ----------
    H : array, shape (n_channels, 2)
        How each output sees (δθ, δω).
    noise : array, shape (n_channels, n_times)
        Output noise rms.
    process : array, shape (n_times,)
        Rms of the acceleration the drive's noise makes, constant over each step. [rad/s²]
    start_rms : two floats
        Uncertainty of the start state, generously.
    damping : float
        d. [1/s]
    """
    dt = np.append(np.diff(t), 0.0)
    n_channels, n = noise.shape
    gain = np.empty((n, n_channels, 2))
    rms = np.empty((n, n_channels))
    P = np.diag(np.square(start_rms)).astype(float)
    _design(H, noise, process, dt, P, damping, gain, rms)
    begin = np.zeros(n, dtype=bool)
    begin[0] = True
    return Filter(gain, rms, H, dt, damping, begin)


def join(filters: Sequence[Filter]) -> Filter:
    """One filter for windows that lie one after the other."""
    stacked = [np.concatenate([getattr(f, name) for f in filters]) for name in ("gain", "rms", "dt", "begin")]
    gain, rms, dt, begin = stacked
    return Filter(gain, rms, filters[0].H, dt, filters[0].damping, begin)


@njit(inline="always")
def _propagate(p00, p01, p11, process, h, damping):
    """Covariance of position and speed one step `h` later, under an acceleration noise of rms `process`."""
    a = np.exp(-damping * h)
    b = (1.0 - a) / damping if damping > 0.0 else h
    q = process**2
    return (
        p00 + 2.0 * b * p01 + b * b * p11 + 0.25 * q * h**4,
        a * p01 + a * b * p11 + 0.5 * q * h**3,
        a * a * p11 + q * h * h,
    )


@njit(cache=True)
def _design(H, noise, process, dt, P, damping, gain, rms):
    p00, p01, p11 = P[0, 0], P[0, 1], P[1, 1]
    for k in range(noise.shape[1]):
        for c in range(noise.shape[0]):
            h0, h1 = H[c, 0], H[c, 1]
            g0, g1 = p00 * h0 + p01 * h1, p01 * h0 + p11 * h1
            s = h0 * g0 + h1 * g1 + noise[c, k] ** 2
            gain[k, c, 0], gain[k, c, 1] = g0 / s, g1 / s
            rms[k, c] = s**0.5
            p00, p01, p11 = p00 - g0 * g0 / s, p01 - g0 * g1 / s, p11 - g1 * g1 / s
        p00, p01, p11 = _propagate(p00, p01, p11, process[k], dt[k], damping)


@njit(cache=True, fastmath=True, nogil=True)
def _whiten(residual, gain, rms, H, dt, damping, begin, out):
    d0, d1 = 0.0, 0.0
    for k in range(residual.shape[1]):
        if begin[k]:
            d0, d1 = 0.0, 0.0
        for c in range(residual.shape[0]):
            e = residual[c, k] - H[c, 0] * d0 - H[c, 1] * d1
            out[c, k] = e / rms[k, c]
            d0 += gain[k, c, 0] * e
            d1 += gain[k, c, 1] * e
        a = np.exp(-damping * dt[k])
        b = (1.0 - a) / damping if damping > 0.0 else dt[k]
        d0 += b * d1
        d1 *= a


@njit(cache=True)
def open_loop_variance(H, noise, process, dt, start, damping, out):
    """Variance of each output's free-run residual under noise alone, from a start covariance (p00, p01, p11)."""
    p00, p01, p11 = start[0], start[1], start[2]
    for k in range(noise.shape[1]):
        for c in range(noise.shape[0]):
            h0, h1 = H[c, 0], H[c, 1]
            out[c, k] = h0 * h0 * p00 + 2.0 * h0 * h1 * p01 + h1 * h1 * p11 + noise[c, k] ** 2
        p00, p01, p11 = _propagate(p00, p01, p11, process[k], dt[k], damping)


@njit(cache=True)
def variance_without_start(H, noise, process, dt, G, modes, damping, out):
    """Variance of r - M a, where a start state a = Σ G r of the first samples is taken off a free run's residual r.

    What a has of the noise of a sample, and of what pushes the state before and after it, is in the residual too. With
    P the state's covariance from a known start, C = Cov(a of samples so far, state), B = Σ G H Φ of later samples:

    Cov(a, r) = (C + B P) Hᵀ + G σ²        Var = H P Hᵀ + σ² - 2 M Cov(a, r) + M Cov(a) Mᵀ

    Parameters
    ----------
    G : array, shape (n_first, 2, n_channels)
    modes : array, shape (n_channels, n_times, 2)
        M: what a start state makes of each output.
    """
    n, m = noise.shape[1], G.shape[0]
    later = np.zeros((m, 2, 2))
    for k in range(m - 2, -1, -1):
        ahead = later[k + 1] + G[k + 1] @ H
        a = np.exp(-damping * dt[k])
        b = (1.0 - a) / damping if damping > 0.0 else dt[k]
        later[k, :, 0], later[k, :, 1] = ahead[:, 0], b * ahead[:, 0] + a * ahead[:, 1]
    P, C, of_start = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 2))
    covariances = np.zeros((n, noise.shape[0], 2))
    for k in range(n):
        if k < m:
            GH = G[k] @ H
            C += GH @ P
            pushed = C @ GH.T
            of_start += pushed + pushed.T - GH @ P @ GH.T
        with_state = C + later[k] @ P if k < m else C
        for c in range(noise.shape[0]):
            covariances[k, c] = with_state @ H[c]
            out[c, k] = H[c] @ P @ H[c] + noise[c, k] ** 2
            if k < m:
                covariances[k, c] += G[k, :, c] * noise[c, k] ** 2
                of_start += np.outer(G[k, :, c], G[k, :, c]) * noise[c, k] ** 2
        a = np.exp(-damping * dt[k])
        b = (1.0 - a) / damping if damping > 0.0 else dt[k]
        p00, p01, p11 = _propagate(P[0, 0], P[0, 1], P[1, 1], process[k], dt[k], damping)
        P[0, 0], P[0, 1], P[1, 0], P[1, 1] = p00, p01, p01, p11
        C[:, 0], C[:, 1] = C[:, 0] + b * C[:, 1], a * C[:, 1]
    for k in range(n):
        for c in range(noise.shape[0]):
            M = modes[c, k]
            out[c, k] += M @ of_start @ M - 2.0 * (M @ covariances[k, c])
