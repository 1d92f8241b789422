"""A signal through a filter of the first order, exact for what it does between its samples."""

from __future__ import annotations

import numpy as np
from numba import njit

from ema.core.records import Array

from . import jit  # noqa: F401  (sets the cache folder before anything is compiled)
from .axis_kernel import HELD, STRAIGHT


@njit(cache=True)
def follow(t, u, time, between):
    """What follows `u` with a time constant: x' = (u - x) / time, in equilibrium before the first sample.

    Parameters
    ----------
    t, u : float[n_samples]
        Stamps [s] and values.
    time : float
        Time constant. [s]
    between : int
        STRAIGHT, HELD or HELD_BEFORE, as in `axis_kernel.simulate_window`.

    Returns
    -------
    float[n_samples]
        Of a straight `u` the values at the stamps; of one that is held, means over what each value stands for.
    """
    out = np.empty_like(u)
    x = u[0]
    out[0] = x
    for k in range(len(u) - 1):
        dt = t[k + 1] - t[k]
        fades = np.exp(-dt / time)
        mean = time / dt * (1.0 - fades)  # of exp(-s / time) over the interval
        if between == STRAIGHT:
            x = u[k + 1] - (u[k + 1] - u[k]) * mean + fades * (x - u[k])
            out[k + 1] = x
        elif between == HELD:
            out[k] = u[k] + (x - u[k]) * mean
            x = u[k] + fades * (x - u[k])
            out[k + 1] = x
        else:
            out[k + 1] = u[k + 1] + (x - u[k + 1]) * mean
            x = u[k + 1] + fades * (x - u[k + 1])
    return out


def precede(t: Array, u: Array, time: float) -> Array:
    """What `u` follows with a `time` constant [s]: u + time u', with the slope between the neighbours of a sample."""
    return np.asarray(u + time * np.gradient(u, t)) if len(u) > 1 else u
