"""Free-run residuals made independent standard normal numbers.

What separates a free run of the right model from the record: noise of each output; the drive's noise, integrated; and
the start state, known only from noisy samples. To first order the deviation δ = (δθ, δω) obeys

    dδθ/dt = δω,    dδω/dt = -d δω + w + g n        y - ŷ = H δ + v

with white w, and n what smoothing has left of the drive's noise: as slow as is left little of it, since a smoother
takes nothing from what is constant (an autoregression of first order, as strong as the noise at low frequencies). So a
Kalman filter with a diffuse start turns y - ŷ into white innovations. Its gains depend on the noise alone, not on
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
class Push:
    """What makes a free run deviate while it goes on.

    Attributes
    ----------
    dt : array, shape (n_times,)
        Time to the next sample; 0 after the last.
    damping : float
        d. [1/s]
    process : array, shape (n_times,)
        Rms of w, constant over each step. [rad/s² or m/s²]
    drive : array, shape (n_times,)
        g: acceleration by one deviation of the drive's noise. [rad/s² or m/s²]
    left : array, shape (n_times,)
        Share of the variance of the drive's noise that is left in the drive: the variance of n.
    """

    dt: Array
    damping: float
    process: Array
    drive: Array
    left: Array

    @property
    def persists(self) -> Array:
        """φ of n[k + 1] = φ n[k] + …, by which n is as strong as all of the noise where it is slow; (n_times,)."""
        return (1.0 - self.left) / (1.0 + self.left)

    @property
    def numbers(self) -> tuple[Array, Array, Array, float, Array, Array]:
        """As compiled code takes them; the last are φ and the variance that each step adds to n."""
        persists = self.persists
        added = np.maximum(np.append(self.left[1:], self.left[-1:]) - persists**2 * self.left, 0.0)
        return self.process, self.drive, self.dt, self.damping, persists, added


@dataclass(frozen=True)
class Filter:
    """Gains (n_times, n_channels, 3), innovation rms (n_times, n_channels), rows H (n_channels, 2), and the push.

    `drive` and `persists` are those of the push, `begin` is true at the first sample of each window; (n_times,).
    """

    gain: Array
    rms: Array
    H: Array
    dt: Array
    damping: float
    drive: Array
    persists: Array
    begin: NDArray[np.bool_]

    def whiten(self, residual: Array) -> Array:
        """White innovations of `residual`, shape (n_channels, n_times)."""
        out = np.empty(residual.shape)
        push = self.dt, self.damping, self.drive, self.persists
        _whiten(residual, self.gain, self.rms, self.H, *push, self.begin, out)
        return out


def design(H: Array, noise: Array, push: Push, start_rms: tuple[float, float]) -> Filter:
    """Filter for one window.

    Parameters
    ----------
    H : array, shape (n_channels, 2)
        How each output sees (δθ, δω).
    noise : array, shape (n_channels, n_times)
        Output noise rms.
    push : Push
    start_rms : two floats
        Uncertainty of the start state, generously.
    """
    n_channels, n = noise.shape
    gain = np.empty((n, n_channels, 3))
    rms = np.empty((n, n_channels))
    P = np.diag([*np.square(start_rms), push.left[0]])
    _design(_seen(H), noise, *push.numbers, P, gain, rms)
    begin = np.zeros(n, dtype=bool)
    begin[0] = True
    return Filter(gain, rms, H, push.dt, push.damping, push.drive, push.persists, begin)


def join(filters: Sequence[Filter]) -> Filter:
    """One filter for windows that lie one after the other."""
    names = ("gain", "rms", "dt", "drive", "persists", "begin")
    gain, rms, dt, drive, persists, begin = (np.concatenate([getattr(f, name) for f in filters]) for name in names)
    return Filter(gain, rms, filters[0].H, dt, filters[0].damping, drive, persists, begin)


def open_loop_variance(H: Array, noise: Array, push: Push, start: Array) -> Array:
    """Variance of each output's free-run residual under noise alone, from a start covariance (2, 2); as `noise`."""
    out = np.empty(noise.shape)
    P = np.zeros((3, 3))
    P[:2, :2], P[2, 2] = start, push.left[0]
    _open_loop_variance(_seen(H), noise, *push.numbers, P, out)
    return out


def variance_without_start(H: Array, noise: Array, push: Push, G: Array, modes: Array) -> Array:
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
    out = np.empty(noise.shape)
    _variance_without_start(_seen(H), noise, *push.numbers, push.left[0], G, modes, out)
    return out


def _seen(H: Array) -> Array:
    """H of the state with the drive's noise, which no output sees by itself."""
    return np.hstack([H, np.zeros((len(H), 1))])


@njit(inline="always")
def _step(F, process, drive, h, damping, persists):
    """Write the transition of the state over one step `h` into F; the process' variance (of w, in δθ and δω)."""
    a = np.exp(-damping * h)
    F[0, 1] = (1.0 - a) / damping if damping > 0.0 else h
    F[1, 1] = a
    F[0, 2], F[1, 2], F[2, 2] = 0.5 * drive * h * h, drive * h, persists
    q = process**2
    return 0.25 * q * h**4, 0.5 * q * h**3, q * h * h


@njit(inline="always")
def _propagate(P, F, process, drive, h, damping, persists, added):
    """Covariance of the state one step `h` later."""
    q00, q01, q11 = _step(F, process, drive, h, damping, persists)
    P[:] = F @ P @ F.T
    P[0, 0] += q00
    P[0, 1] += q01
    P[1, 0] += q01
    P[1, 1] += q11
    P[2, 2] += added


@njit(cache=True)
def _design(H, noise, process, drive, dt, damping, persists, added, P, gain, rms):
    F = np.eye(3)
    for k in range(noise.shape[1]):
        for c in range(noise.shape[0]):
            g = P @ H[c]
            s = H[c] @ g + noise[c, k] ** 2
            gain[k, c] = g / s
            rms[k, c] = s**0.5
            P -= np.outer(g, g) / s
        _propagate(P, F, process[k], drive[k], dt[k], damping, persists[k], added[k])


@njit(cache=True, fastmath=True, nogil=True)
def _whiten(residual, gain, rms, H, dt, damping, drive, persists, begin, out):
    d0, d1, d2 = 0.0, 0.0, 0.0
    for k in range(residual.shape[1]):
        if begin[k]:
            d0, d1, d2 = 0.0, 0.0, 0.0
        for c in range(residual.shape[0]):
            e = residual[c, k] - H[c, 0] * d0 - H[c, 1] * d1
            out[c, k] = e / rms[k, c]
            d0 += gain[k, c, 0] * e
            d1 += gain[k, c, 1] * e
            d2 += gain[k, c, 2] * e
        a = np.exp(-damping * dt[k])
        b = (1.0 - a) / damping if damping > 0.0 else dt[k]
        pushed = drive[k] * dt[k] * d2
        d0 += b * d1 + 0.5 * dt[k] * pushed
        d1 = a * d1 + pushed
        d2 *= persists[k]


@njit(cache=True)
def _open_loop_variance(H, noise, process, drive, dt, damping, persists, added, P, out):
    F = np.eye(3)
    for k in range(noise.shape[1]):
        for c in range(noise.shape[0]):
            out[c, k] = H[c] @ P @ H[c] + noise[c, k] ** 2
        _propagate(P, F, process[k], drive[k], dt[k], damping, persists[k], added[k])


@njit(cache=True)
def _variance_without_start(H, noise, process, drive, dt, damping, persists, added, left, G, modes, out):
    n, m = noise.shape[1], G.shape[0]
    F = np.eye(3)
    later = np.zeros((m, 2, 3))
    for k in range(m - 2, -1, -1):
        _step(F, process[k], drive[k], dt[k], damping, persists[k])
        later[k] = (later[k + 1] + G[k + 1] @ H) @ F
    P, C, of_start = np.zeros((3, 3)), np.zeros((2, 3)), np.zeros((2, 2))
    P[2, 2] = left
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
        _propagate(P, F, process[k], drive[k], dt[k], damping, persists[k], added[k])
        C[:] = C @ F.T
    for k in range(n):
        for c in range(noise.shape[0]):
            M = modes[c, k]
            out[c, k] += M @ of_start @ M - 2.0 * (M @ covariances[k, c])
