"""Ripple of the torque constant: harmonics of the magnets' flux, or of the phase currents, as the rotor turns.

Of cogging it has the orders, but it grows with the current and is nothing without one. Twice per electrical turn it is
what unequal sensors or windings of the phases make; harmonics of the flux make it at multiples of six.

References
----------
Jahns and Soong, "Pulsating torque minimization techniques for permanent magnet AC motor drives - a review", IEEE
Transactions on Industrial Electronics 43, 1996, doi:10.1109/41.491356.
"""

from __future__ import annotations

from .base import Effect, Parameter
from .cogging import EFFECT as COGGING
from .vector_math import sin

_, _order, _phase = COGGING.parameters


def torque(theta_m, w_m, theta_u, i_q, amplitude, order, phase):
    """τ = A i sin(n θ_m + φ): of the torque k_t i, that is taken   [N m]"""
    return amplitude * i_q * sin(order * theta_m + phase)


EFFECT = Effect(
    name="flux_ripple",
    parameters=(
        Parameter("amplitude", "N m/A", 0.0, 0.0, 100.0, 0.001, "amplitude of the torque constant's ripple"),
        _order,
        _phase,
    ),
    sentence="the drive gives {amplitude:.3g} N m/A of the current more and less, with {order:.4g} periods per rotor "
    "turn: a torque constant that ripples (harmonics of the magnets' flux, unequal phases)",
    separated_by="the same slow motion with another load: this grows with the current, cogging stays",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
