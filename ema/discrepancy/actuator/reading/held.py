"""The user behind a play: held where it was pushed, or pressed to one side by its load."""

from __future__ import annotations

import numpy as np
from numba import njit

from ema.core.records import Array
from ema.effects.backlash import follow

PLAYS = np.concatenate([[0.0], np.geomspace(1e-3, 1.0, 20)])  # k2 that are tried


def held_user(shaft: Array, start: float, b: float) -> Array:
    """θ_u behind a play in which it stays where it was pushed. [rad]"""
    return np.asarray(pressed_user(shaft, start, b, 1.0, 0.0, np.inf))


@njit(cache=True, nogil=True)
def pressed_user(shaft: Array, start: float, b: float, side: float, centre: float, holds: float) -> Array:
    """θ_u behind a play, from where it starts; its load presses it to a `side` outside `centre` ± `holds`. [rad]"""
    user = np.empty(len(shaft))
    theta_u = start
    for t in range(len(shaft)):
        theta_u = follow(theta_u, shaft[t], b)
        if shaft[t] - centre > holds:
            theta_u = shaft[t] - side * b
        elif shaft[t] - centre < -holds:
            theta_u = shaft[t] + side * b
        user[t] = theta_u
    return user
