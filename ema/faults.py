"""The fault vector k = [k1 … k6] (0 healthy … 1 complete failure) and how it enters the plant's parameters.

====  =======================  ==============================================================
k1    dry friction             F_s, F_d × (1 + 3 k1)
k2    backlash                 b × (1 + 100 k2)
k3-5  short of phase A, B, C   N_j = 1 - k,   R_j = R N_j,   L_j = L N_j²,   κ_j ∝ N_j
k6    static eccentricity      ζ = k6
====  =======================  ==============================================================
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ema.core.errors import ConfigError
from ema.core.names import FAULTS

V = TypeVar("V", float, np.ndarray)

N_FAULTS = len(FAULTS)
N_MIN = 0.02  # turns left of a completely shorted phase: no inductance at all would be no circuit


def checked(k: np.ndarray) -> np.ndarray:
    """The fault vectors as an array of shape (n, 6); ConfigError where one is not within 0…1."""
    k = np.atleast_2d(np.asarray(k, dtype=float))
    if k.ndim != 2 or k.shape[1] != N_FAULTS:
        raise ConfigError(f"a fault vector has {N_FAULTS} elements ({', '.join(FAULTS)}), got shape {k.shape}")
    if not (np.isfinite(k).all() and (k >= 0).all() and (k <= 1).all()):
        bad = np.argwhere(~((k >= 0) & (k <= 1)))[0]
        raise ConfigError(f"fault {FAULTS[bad[1]]} = {k[tuple(bad)]:g} of vector {bad[0]} is not within 0…1")
    return k


def friction(F: float, k1: np.ndarray) -> np.ndarray:
    """Static or sliding friction torque.   F (1 + 3 k1)   [N m]"""
    return F * (1.0 + 3.0 * k1)


def backlash(b: float, k2: V) -> V:
    """Half-width of the backlash.   b (1 + 100 k2)   [rad]"""
    return b * (1.0 + 100.0 * k2)


def turns(k_phase: np.ndarray) -> np.ndarray:
    """Share of a phase's turns that is not shorted.   N = 1 - k   [1]"""
    return np.maximum(1.0 - k_phase, N_MIN)
