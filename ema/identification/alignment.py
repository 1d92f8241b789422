"""Does the record's rotor angle have the plant's zero, sense and phase order?

A resolver's zero and the order of three phases are facts of an installation, not faults; a model with another
convention would explain them by shorts and eccentricity. They show in the phase currents themselves: in six-step
operation the space vector of the currents stands across the rotor,

    i_a + i_b e^{j2π/3} + i_c e^{-j2π/3} ∝ ±e^{j(p θ_m + θ₀ - π/2)},

with + where the torque is positive.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Alignment(NamedTuple):
    """`theta_0`: electrical angle at θ_m = 0 [rad, -π…π]; `reversed_order`: phases B and C are exchanged;
    `coherence`: 0…1, how well the currents follow the rotor angle (below about 0.7 the answer means nothing).
    """

    theta_0: float
    reversed_order: bool
    coherence: float


def alignment(i_abc: np.ndarray, theta_m: np.ndarray, p: int, rate: float) -> Alignment:
    """Find the rotor's electrical zero from phase currents.

    Parameters
    ----------
    i_abc : array, shape (n, 3, n_times)
        Phase currents of n cycles. [A]
    theta_m : array, shape (n, n_times)
        Rotor angle. [rad]
    p : int
        Pole pairs.
    rate : float
        Sampling rate. [Hz]
    """
    a = np.exp(2j * np.pi / 3)
    found = []
    for swapped in (False, True):
        i_a, i_b, i_c = np.moveaxis(i_abc[:, [0, 2, 1]] if swapped else i_abc, 1, 0)
        x = (i_a + a * i_b + a.conjugate() * i_c) * np.exp(-1j * p * theta_m)  # in the rotor's frame
        squared = np.sum(x * x)  # the torque's sign drops out
        coherence = float(np.abs(squared) / max(np.sum(np.abs(x) ** 2), 1e-30))
        angle = 0.5 * np.angle(squared)
        # the torque accelerates the rotor: of the two directions take the one in which current and acceleration agree
        torque = np.real(x * np.exp(-1j * angle))
        speed = np.gradient(theta_m, 1.0 / rate, axis=-1)
        acceleration = np.gradient(_smooth(speed, rate), 1.0 / rate, axis=-1)
        if np.sum(_smooth(torque, rate) * acceleration) < 0:
            angle += np.pi
        found.append(Alignment(float(np.angle(np.exp(1j * (angle + np.pi / 2)))), swapped, coherence))
    return max(found, key=lambda alignment: alignment.coherence)


def _smooth(x: np.ndarray, rate: float) -> np.ndarray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(x, max(3, round(3e-3 * rate)), axis=-1))
