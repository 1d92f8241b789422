"""Ripple of the torque constant: harmonics of the magnets' flux, or of the phase currents, as the rotor turns.

Of cogging it has the orders, but it grows with the current and is nothing without one. Twice per electrical turn it is
what unequal sensors or windings of the phases make; harmonics of the flux make it at multiples of six.

References
----------
Jahns and Soong, "Pulsating torque minimization techniques for permanent magnet AC motor drives - a review", IEEE
Transactions on Industrial Electronics 43, 1996, doi:10.1109/41.491356.
"""

from __future__ import annotations

from math import pi

from .base import Effect, Parameter
from .vector_math import sin


def torque(theta_m, w_m, theta_u, i_q, amplitude, order, phase):
    """τ = A i sin(n θ_m + φ): of the torque k_t i, that is taken   [N m]"""
    return amplitude * i_q * sin(order * theta_m + phase)


EFFECT = Effect(
    name="flux_ripple",
    parameters=(
        Parameter("amplitude", "N m/A", 0.0, 0.0, 100.0, 0.001, "amplitude of the torque constant's ripple"),
        Parameter("order", "1/turn", 12.0, 1.0, 240.0, 12.0, "periods per mechanical turn"),
        Parameter("phase", "rad", 0.0, -pi, pi, 0.0, "phase at an angle of zero"),
    ),
    sentence="the drive gives {amplitude:.3g} N m/A of the current more and less, with {order:.4g} periods per rotor "
    "turn: a torque constant that ripples (harmonics of the magnets' flux, unequal phases)",
    separated_by="the same slow motion with another load: this grows with the current, cogging stays",
    laws={"shaft_torque": torque},
    mistaken_for=("k1",),
    plants=("axis",),
)
