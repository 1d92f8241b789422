"""Local polynomials and test functions on time stamps as they are."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ema.core.records import Array

CHUNK = 2_000  # samples at a time: what a processor's cache holds
FEWEST = 7  # samples on a test function
POWER = 4  # of a test function (1 - s²)^p: its first three derivatives vanish at its ends


def local_polynomial(t: Array, x: Array, half: int, degree: int) -> Array:
    """Value and derivatives of x at every sample, shape (degree + 1, n_times): least squares on 2 `half` + 1 samples.

    Samples weigh less the farther they are (Epanechnikov's kernel); at the ends the window lies to one side.
    """
    n, width = len(t), 2 * half + 1
    if n < width:
        half = max((n - 1) // 2, 1)
        width = 2 * half + 1
    first = np.clip(np.arange(n) - half, 0, n - width)
    times, values = sliding_window_view(t, width), sliding_window_view(x, width)
    out = np.empty((degree + 1, n))
    for a in range(0, n, CHUNK):
        rows = first[a : a + CHUNK]
        here = t[a : a + CHUNK, None]
        span = np.maximum(times[rows, -1] - here[:, 0], here[:, 0] - times[rows, 0])[:, None]
        s = (times[rows] - here) / span
        y, weight = values[rows] - x[a : a + CHUNK, None], 1.0 - 0.99 * s * s
        moments, right = np.empty((2 * degree + 1, len(rows))), np.empty((degree + 1, len(rows)))
        for k in range(2 * degree + 1):  # weight is times s^k
            moments[k] = weight.sum(axis=1)
            if k <= degree:
                right[k] = np.einsum("ij,ij->i", weight, y)
            weight *= s
        normal = moments[np.add.outer(np.arange(degree + 1), np.arange(degree + 1))].transpose(2, 0, 1)
        c = np.linalg.solve(normal, right.T[:, :, None])[:, :, 0]
        c[:, 0] += x[a : a + CHUNK]
        factorial = 1.0
        for k in range(degree + 1):
            factorial *= max(k, 1)
            out[k, a : a + CHUNK] = factorial * c[:, k] / span[:, 0] ** k
    return out


def bumps_at(
    t: Array, centres: NDArray[np.int_], half: float
) -> tuple[NDArray[np.int_], Array, Array, Array, NDArray[np.bool_]]:
    """Weights of ∫ φ f dt, -∫ φ' f dt and ∫ φ'' f dt on samples, for bumps of half width `half` [s].

    As sums they hold exactly what they do as integrals: the first keeps a constant; the second makes 1 of t and 0 of a
    constant; the third makes 2 of t² and 0 of constants and t. An angle far from zero would else be a torque.

    Returns
    -------
    index : array, shape (n, width)
        Samples.
    phi, first, second : arrays, shape (n, width)
    whole : array of bool, shape (n,)
        Whether the bump lies on the record and has no gap in it.
    """
    n = len(t)
    at = t[centres]
    low, high = np.searchsorted(t, at - half, "left"), np.searchsorted(t, at + half, "right")
    width = int((high - low).max())
    index = np.minimum(low[:, None] + np.arange(width), n - 1)
    inside = low[:, None] + np.arange(width) < high[:, None]
    s = np.where(inside, (t[index] - at[:, None]) / half, 1.0)
    step = np.gradient(t)[index] * inside
    base = np.maximum(1.0 - s**2, 0.0)
    phi = base**POWER * step
    slope = -2.0 * POWER * s * base ** (POWER - 1) * step
    curve = POWER * (4.0 * (POWER - 1) * s**2 * base ** (POWER - 2) - 2.0 * base ** (POWER - 1)) * step
    tau = s * inside
    enough = high - low >= FEWEST

    def moment(weights: Array, power: int) -> Array:
        return (weights * tau**power).sum(axis=1, keepdims=True)

    def scaled(weights: Array, by: Array) -> Array:
        return weights / np.where(enough[:, None], by, 1.0)

    phi = scaled(phi, moment(phi, 0))
    slope -= moment(slope, 0) * phi
    slope = scaled(slope, moment(slope, 1))
    curve -= moment(curve, 0) * phi
    curve -= moment(curve, 1) * slope
    curve = 2.0 * scaled(curve, moment(curve, 2))
    gap = 5.0 * float(np.median(np.diff(t)))
    broken = np.concatenate(([0], np.cumsum(np.diff(t) > gap)))
    whole = (broken[index[:, 0]] == broken[np.minimum(high, n) - 1]) & (at - t[0] >= 0.98 * half)
    whole &= (t[-1] - at >= 0.98 * half) & enough
    return index, phi, slope / half, curve / half**2, whole
